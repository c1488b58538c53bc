//! Size and time of the tile encodings; they have no effect on accuracy.

use super::configurations::functional;
use super::headline::Replayed;
use super::inputs::{Inputs, time_ratio};
use super::metric::{Metric, metric};
use super::study::{Choice, Study, StudyError};
use formats::text::name_of;
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as};
use sim::stream::TileSource;

const FIGURES: [Metric; 2] = [
    metric("external_bytes", "external bytes", "%"),
    metric("file_pct", "file", "% of raw"),
];

pub(super) const ENCODING: Study = Study {
    key: "encoding",
    title: "Encoding of the trace",
    about: "Tiles written again in each encoding and replayed in functional mode; every encoding is lossless. Errors are against raw records.",
    time: "replay, over that of raw",
    reference: "raw",
    recommended: "delta",
    reason: "no error, a quarter of the file size, and as fast as raw records; planes is smaller still",
    figures: &FIGURES,
    measure: encodings,
};

fn encodings(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let config = functional(inputs.config);
    let mut choices = Vec::new();
    for subject in inputs.stills() {
        let raw = written(subject.source, Encoding::Raw)?;
        let raw_bytes = raw.len();
        let expected = Replayed::new(&Textrace::from_bytes(raw)?, config)?;
        for encoding in Encoding::ALL.into_iter().filter(|e| *e != Encoding::Raw) {
            let bytes = written(subject.source, encoding)?;
            let share = 100.0 * bytes.len() as f64 / raw_bytes as f64;
            let found = Replayed::new(&Textrace::from_bytes(bytes)?, config)?;
            choices.push(Choice {
                name: name_of(&encoding),
                scene: subject.label.clone(),
                time_ratio: Some(time_ratio(found.time, expected.time)),
                values: vec![found.errors(&expected)[0], Some(share)],
                ..Choice::default()
            });
        }
    }
    Ok(choices)
}

/// A trace's file in an encoding.
fn written(trace: &dyn TileSource, encoding: Encoding) -> Result<Vec<u8>, StudyError> {
    let tables = trace.tables();
    let mut writer = TextraceWriter::in_memory(tables)?;
    let mut tile = Tile::default();
    for (pass, of) in tables.passes.iter().enumerate() {
        for index in 0..of.tile_count() {
            trace.read_tile(pass as u32, index, &mut tile)?;
            let encoded = encode_tile_as(encoding, tables, &tile)?;
            writer.append(pass, index as usize, encoded)?;
        }
    }
    Ok(writer.into_bytes()?)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace};
    use super::*;

    #[test]
    fn every_encoding_has_the_same_replay_and_is_smaller_than_raw() {
        let trace = small_trace();
        let choices = encodings(&inputs(&trace)).unwrap();
        assert_eq!(choices.len(), Encoding::ALL.len() - 1);
        for choice in choices {
            assert_eq!(choice.values[0], Some(0.0), "{choice:?}");
            assert!(choice.values[1].unwrap() < 100.0, "{choice:?}");
        }
    }
}
