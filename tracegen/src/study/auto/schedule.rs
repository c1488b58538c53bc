//! The combination of each frame of a path, chosen by `--auto` or named by the user.

use super::guard::Held;
use crate::study::rows::Row;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Combinations by frame: `ROW`, then exceptions, `FRAME:ROW` or `FIRST-LAST:ROW`, joined by commas.
#[derive(Clone, Debug)]
pub struct Schedule {
    /// The combination of frames without an exception.
    row: Row,
    exceptions: Vec<(RangeInclusive<u32>, Row)>,
}

impl Schedule {
    /// The schedule of a checked search.
    pub fn of(held: &Held) -> Self {
        let mut exceptions: Vec<(RangeInclusive<u32>, usize)> = Vec::new();
        for (frame, &position) in (0..).zip(&held.of_frame) {
            match exceptions.last_mut() {
                _ if position == 0 => (),
                Some((frames, same)) if *same == position && frames.end() + 1 == frame => {
                    *frames = *frames.start()..=frame;
                }
                _ => exceptions.push((frame..=frame, position)),
            }
        }
        let named = |(frames, position): (_, usize)| (frames, held.chain[position].clone());
        Self {
            row: held.chain[0].clone(),
            exceptions: exceptions.into_iter().map(named).collect(),
        }
    }

    /// The combination of a frame.
    pub fn row(&self, frame: u32) -> &Row {
        let of = |(frames, _): &&(RangeInclusive<u32>, Row)| frames.contains(&frame);
        (self.exceptions.iter().find(of)).map_or(&self.row, |(_, row)| row)
    }

    /// The last frame with an exception.
    pub fn last_frame(&self) -> Option<u32> {
        let ends = self.exceptions.iter().map(|(frames, _)| *frames.end());
        ends.max()
    }
}

impl FromStr for Schedule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let row = |name: &str| Row::parse(name.trim()).map_err(|error| error.to_string());
        let mut words = text.split(',');
        let first = words.next().unwrap_or_default();
        if first.contains(':') {
            return Err(format!(
                "expected a technique for all frames before those of single frames, found '{first}'"
            ));
        }
        let mut exceptions: Vec<(RangeInclusive<u32>, Row)> = Vec::new();
        for word in words {
            let expected =
                || format!("expected FRAME:TECHNIQUE or FIRST-LAST:TECHNIQUE, found '{word}'");
            let (frames, name) = word.split_once(':').ok_or_else(expected)?;
            let (start, end) = frames.split_once('-').unwrap_or((frames, frames));
            let number = |text: &str| text.trim().parse::<u32>().map_err(|_| expected());
            let frames = number(start)?..=number(end)?;
            let before = exceptions.last().map(|(frames, _)| *frames.end());
            if frames.is_empty() || before.is_some_and(|end| end >= *frames.start()) {
                return Err(format!(
                    "expected frames in ascending order, found '{word}'"
                ));
            }
            exceptions.push((frames, row(name)?));
        }
        Ok(Self {
            row: row(first)?,
            exceptions,
        })
    }
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.row.name)?;
        for (frames, row) in &self.exceptions {
            let (first, last) = (frames.start(), frames.end());
            match first == last {
                true => write!(f, ",{first}:{}", row.name)?,
                false => write!(f, ",{first}-{last}:{}", row.name)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schedule_is_read_as_it_is_written() {
        let chain = ["superfrustum+far-field", "superfrustum", "per-eye"];
        let held = Held {
            chain: chain.map(|name| Row::parse(name).unwrap()).into(),
            of_frame: vec![0, 1, 1, 0, 2, 1, 0],
            errors: vec![0.0; 7],
        };
        let text = Schedule::of(&held).to_string();
        assert_eq!(
            text,
            "superfrustum+far-field,1-2:superfrustum,4:per-eye,5:superfrustum"
        );
        let read: Schedule = text.parse().unwrap();
        assert_eq!(read.to_string(), text);
        for (frame, &position) in (0..).zip(&held.of_frame) {
            assert_eq!(read.row(frame).name, chain[position], "{frame}");
        }
        assert_eq!(read.last_frame(), Some(5));
    }

    #[test]
    fn schedules_that_contradict_themselves_are_refused() {
        for text in [
            "",
            "octree",
            "1:conical",
            "conical,superfrustum",
            "conical,2-1:superfrustum",
            "conical,1-3:superfrustum,3:per-eye",
            "conical,x:superfrustum",
            "conical,1:octree",
            "conical+superfrustum",
        ] {
            let error = text.parse::<Schedule>().unwrap_err();
            assert!(
                error.contains("found") || error.contains("exclude") || error.contains("unknown"),
                "{text}: {error}"
            );
        }
    }
}
