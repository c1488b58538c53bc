//! Distributes work over many machines.

use std::ops::Range;
use std::str::FromStr;

/// Limit on the number of shards.
pub const MOST_SHARDS: u32 = 10_000;

/// Value of `--shard` without an argument.
const FROM_SLURM: &str = "slurm";

/// One of several parts of a command's work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `count`.
    pub number: u32,
    /// Number of parts.
    pub count: u32,
}

/// Flags of a command whose work can be split.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "Many machines")]
pub struct ShardArgs {
    /// Do only part K of N, balanced by estimated cost [without K/N: from the task number of the Slurm job
    /// array]
    #[arg(long, value_name = "K/N", num_args = 0..=1, default_missing_value = FROM_SLURM,
          value_parser = parse_shard)]
    pub shard: Option<Shard>,
    /// Print a Slurm script that does the work in N parts, and stop
    #[arg(long, value_name = "N", conflicts_with = "shard",
          value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SHARDS)))]
    pub emit_slurm: Option<u32>,
}

fn parse_shard(text: &str) -> Result<Shard, String> {
    if text == FROM_SLURM {
        let variable = |name: &str| Some(std::env::var_os(name)?.to_string_lossy().into_owned());
        return Shard::from_slurm(variable);
    }
    text.parse()
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, count))
                if (1..=MOST_SHARDS).contains(&count) && (1..=count).contains(&number) =>
            {
                Ok(Self { number, count })
            }
            _ => Err(format!(
                "expected K/N with K from 1 to N and N from 1 to {MOST_SHARDS}, found `{text}`"
            )),
        }
    }
}

impl Shard {
    /// The shard of a task in a Slurm job array, whose numbers may start anywhere and have a step.
    ///
    /// # Errors
    /// A variable that is missing or not a number, or an array whose numbers have gaps, because the shard of
    /// such a task cannot be computed from the environment.
    pub fn from_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| -> Result<Option<u32>, String> {
            let Some(text) = variable(name) else {
                return Ok(None);
            };
            let number = text.parse().map(Some);
            number.map_err(|_| format!("{name}: expected a number, found `{text}`"))
        };
        let needed = |name: &str| {
            let missing =
                || format!("{name} is not set: expected the task of a Slurm job array, or K/N");
            number(name)?.ok_or_else(missing)
        };
        let id = needed("SLURM_ARRAY_TASK_ID")?;
        let count = needed("SLURM_ARRAY_TASK_COUNT")?;
        let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(1);
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1);
        let last = number("SLURM_ARRAY_TASK_MAX")?;
        let index = |id: u32| {
            let offset = id.checked_sub(first)?;
            let index = offset.checked_div(step)?;
            (offset == index * step && index < count).then_some(index)
        };
        let has_gaps = last.is_some_and(|last| index(last).map(|i| i + 1) != Some(count));
        match index(id) {
            Some(index) if !has_gaps && count <= MOST_SHARDS => Ok(Self {
                number: index + 1,
                count,
            }),
            _ => Err(format!(
                "SLURM_ARRAY_TASK_ID {id}: expected an array of {count} numbers from {first} in steps of {step}, \
                 at most {MOST_SHARDS} of them; name the shard as K/N"
            )),
        }
    }
}

/// A unit of work that one machine does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Cost in any unit.
    pub cost: u64,
    /// Index of its set. Pieces of the same set are adjacent and share a preparation.
    pub set: usize,
}

/// Distributes pieces over shards, in order, to minimise the cost of the most expensive shard. A shard pays
/// a set's preparation once. Returns the pieces of each shard.
///
/// `preparation[set]` is the cost of a set for each shard with pieces of it.
pub fn balanced(pieces: &[Piece], preparation: &[u64], count: u32) -> Vec<Range<usize>> {
    let line = Line::new(pieces, preparation);
    let end = pieces.len();
    // Find the smallest bound that `count` shards can keep. Filling each shard up to the bound needs the
    // fewest shards.
    let (mut below, mut bound) = (0, line.cost(0, end));
    while bound - below > 1 {
        let middle = below + (bound - below) / 2;
        if line.shards_needed(middle)[0] <= count {
            bound = middle;
        } else {
            below = middle;
        }
    }
    let needed = line.shards_needed(bound);
    let mut first = 0;
    let shards = (0..count).rev().map(|others| {
        // Give work to empty shards if another one has several pieces.
        let fair = line.cost(first, end) / u64::from(others + 1);
        let most = line.filled(first, bound);
        let enough = |&last: &usize| needed[last] <= others && line.cost(first, last) >= fair;
        let last = (first + 1..most).find(enough).unwrap_or(most);
        let shard = first..last;
        first = last;
        shard
    });
    shards.collect()
}

/// Consecutive pieces to be divided.
struct Line<'a> {
    pieces: &'a [Piece],
    preparation: &'a [u64],
    /// Cumulative cost before each piece, with each set's preparation paid once.
    before: Vec<u64>,
}

impl<'a> Line<'a> {
    fn new(pieces: &'a [Piece], preparation: &'a [u64]) -> Self {
        let mut line = Self {
            pieces,
            preparation,
            before: vec![0],
        };
        let mut sum = 0u64;
        for (index, piece) in pieces.iter().enumerate() {
            let shared = if line.begins_set(index) {
                line.prepared(index)
            } else {
                0
            };
            sum = sum.saturating_add(piece.cost).saturating_add(shared);
            line.before.push(sum);
        }
        line
    }

    fn begins_set(&self, index: usize) -> bool {
        index == 0 || self.pieces[index - 1].set != self.pieces[index].set
    }

    fn prepared(&self, index: usize) -> u64 {
        self.preparation
            .get(self.pieces[index].set)
            .copied()
            .unwrap_or(0)
    }

    /// Cost of a shard with these pieces.
    fn cost(&self, first: usize, last: usize) -> u64 {
        if first >= last {
            return 0;
        }
        let again = if self.begins_set(first) {
            0
        } else {
            self.prepared(first)
        };
        (self.before[last] - self.before[first]).saturating_add(again)
    }

    /// End of a shard that starts at `first` and keeps the bound; it has at least one piece.
    fn filled(&self, first: usize, bound: u64) -> usize {
        let fits = |last: &usize| self.cost(first, *last) <= bound;
        let ends: usize = {
            let (mut low, mut high) = (first, self.pieces.len());
            while low < high {
                let middle = (low + high).div_ceil(2);
                if fits(&middle) {
                    low = middle;
                } else {
                    high = middle - 1;
                }
            }
            low
        };
        ends.max(first + 1).min(self.pieces.len())
    }

    /// Number of shards that the pieces from each index on need within the bound; larger than the number of
    /// pieces if a single piece exceeds the bound.
    fn shards_needed(&self, bound: u64) -> Vec<u32> {
        let end = self.pieces.len();
        let mut needed = vec![0u32; end + 1];
        for first in (0..end).rev() {
            let last = self.filled(first, bound);
            needed[first] = if self.cost(first, last) > bound {
                u32::MAX
            } else {
                needed[last].saturating_add(1)
            };
        }
        needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shard_arguments_are_parsed_and_checked() {
        let shard: Shard = "3/4".parse().unwrap();
        assert_eq!((shard.number, shard.count), (3, 4));
        for text in [
            "0/4", "5/4", "1/0", "1/10001", "4", "", "a/b", "-1/2", "1/2/3", " 1/2",
        ] {
            let error = text.parse::<Shard>().unwrap_err();
            assert!(error.contains(&format!("found `{text}`")), "{error}");
        }
    }

    fn of_slurm(variables: &[(&str, &str)]) -> Result<(u32, u32), String> {
        let found = |name: &str| {
            let short = name.strip_prefix("SLURM_ARRAY_TASK_").unwrap();
            let entry = variables.iter().find(|(key, _)| *key == short);
            entry.map(|(_, value)| (*value).to_owned())
        };
        Shard::from_slurm(found).map(|shard| (shard.number, shard.count))
    }

    #[test]
    fn a_slurm_task_finds_its_shard_wherever_its_array_starts() {
        assert_eq!(of_slurm(&[("ID", "2"), ("COUNT", "4")]), Ok((2, 4)));
        let array = |id, count, min, max, step| {
            of_slurm(&[
                ("ID", id),
                ("COUNT", count),
                ("MIN", min),
                ("MAX", max),
                ("STEP", step),
            ])
        };
        assert_eq!(array("0", "4", "0", "3", "1"), Ok((1, 4)));
        assert_eq!(array("13", "4", "10", "13", "1"), Ok((4, 4)));
        assert_eq!(array("6", "4", "0", "6", "2"), Ok((4, 4)));
        // --array=1,5,9, and a variable with a wrong value.
        for id in ["1", "5", "9"] {
            assert!(array(id, "3", "1", "9", "1").unwrap_err().contains("K/N"));
        }
        assert!(array("7", "4", "0", "6", "2").is_err());
        assert!(array("1", "4", "0", "3", "0").is_err());
        assert!(array("1", "20000", "0", "19999", "1").is_err());
        assert!(of_slurm(&[("ID", "0"), ("COUNT", "4")]).is_err());
    }

    #[test]
    fn slurm_variables_that_are_missing_or_not_numbers_are_named() {
        for (variables, expected) in [
            (&[][..], "SLURM_ARRAY_TASK_ID is not set"),
            (&[("ID", "1")], "SLURM_ARRAY_TASK_COUNT is not set"),
            (
                &[("ID", "one"), ("COUNT", "4")],
                "SLURM_ARRAY_TASK_ID: expected a number, found `one`",
            ),
            (
                &[("ID", "1"), ("COUNT", "4"), ("MIN", "")],
                "SLURM_ARRAY_TASK_MIN: expected a number, found ``",
            ),
        ] {
            let error = of_slurm(variables).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }

    fn pieces(sets: &[&[u64]]) -> Vec<Piece> {
        let of = |(set, costs): (usize, &&[u64])| {
            let piece = move |&cost: &u64| Piece { cost, set };
            costs.iter().map(piece).collect::<Vec<_>>()
        };
        sets.iter().enumerate().flat_map(of).collect()
    }

    /// The smallest cost of the most expensive shard, by trying every division.
    fn least(line: &Line, first: usize, shards: u32) -> u64 {
        let end = line.pieces.len();
        if shards == 1 {
            return line.cost(first, end);
        }
        let cut = |at| line.cost(first, at).max(least(line, at, shards - 1));
        (first..=end).map(cut).min().unwrap()
    }

    #[test]
    fn balanced_shards_have_the_smallest_possible_maximum_cost() {
        let mut seed = 1u64;
        let mut random = |below: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) % below
        };
        for _ in 0..500 {
            let sets: Vec<Vec<u64>> = (0..1 + random(4))
                .map(|_| (0..1 + random(4)).map(|_| random(9)).collect())
                .collect();
            let sets: Vec<&[u64]> = sets.iter().map(Vec::as_slice).collect();
            let pieces = pieces(&sets);
            let preparation: Vec<u64> = sets.iter().map(|_| random(9)).collect();
            let count = 1 + random(6) as u32;
            let shards = balanced(&pieces, &preparation, count);
            let line = Line::new(&pieces, &preparation);
            let cost = shards
                .iter()
                .map(|s| line.cost(s.start, s.end))
                .max()
                .unwrap();
            assert_eq!(
                cost,
                least(&line, 0, count),
                "{pieces:?} {preparation:?} {count}"
            );
            // Every piece once, in order.
            assert_eq!(shards.len(), count as usize);
            let dealt: Vec<usize> = shards.into_iter().flatten().collect();
            assert_eq!(dealt, (0..pieces.len()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_set_is_not_divided_more_often_than_the_balance_needs() {
        let shards = balanced(&pieces(&[&[1; 8], &[1; 8]]), &[100, 100], 4);
        assert_eq!(shards, [0..4, 4..8, 8..12, 12..16]);
    }

    #[test]
    fn work_is_spread_over_all_shards_if_there_are_enough_pieces() {
        let sizes = |pieces: &[Piece], count| -> Vec<usize> {
            balanced(pieces, &[0], count)
                .iter()
                .map(ExactSizeIterator::len)
                .collect()
        };
        assert_eq!(
            sizes(&pieces(&[&[1; 9]]), 8)
                .iter()
                .filter(|n| **n > 0)
                .count(),
            8
        );
        assert_eq!(sizes(&pieces(&[&[5; 2]]), 4), [1, 1, 0, 0]);
        assert_eq!(sizes(&[], 3), [0, 0, 0]);
    }

    #[test]
    fn a_hundred_thousand_pieces_are_distributed_fast() {
        let many = vec![
            Piece {
                cost: u64::MAX / 1000,
                set: 0
            };
            100_000
        ];
        assert_eq!(
            balanced(&many, &[7], MOST_SHARDS).len(),
            MOST_SHARDS as usize
        );
    }
}
