//! Divides a draw of a program into draws of the trace, which have at most [`MAX_GROUPS`] uv groups each.
//!
//! Each quad of a primitive belongs to one draw, so its fragments count once, and the primitives stay in order:
//! the draws are ranges of primitives. Only a primitive that needs too many groups by itself has several draws.

use formats::textrace::tables::MAX_GROUPS;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A coordinate group, and the element of its binding's array if it varies between fragments.
pub type GroupKey = (u16, Option<u32>);
/// Coordinate groups of a draw or a quad.
pub type Groups = BTreeSet<GroupKey>;
/// The groups of the quads of each primitive.
pub type OfPrimitives = BTreeMap<u32, BTreeSet<Groups>>;

/// Primitives, and the groups of each of their draws.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Portion {
    pub primitives: Range<u32>,
    /// At least one draw.
    pub draws: Vec<Groups>,
}

/// Number of uv groups of the trace that coordinate groups need; one that is not in `sizes` needs none.
pub fn size(groups: &Groups, sizes: &BTreeMap<GroupKey, usize>) -> usize {
    groups.iter().filter_map(|key| sizes.get(key)).sum()
}

/// Divides `primitives` primitives, of which `quads` have records.
pub fn portions(
    quads: &OfPrimitives,
    sizes: &BTreeMap<GroupKey, usize>,
    primitives: u32,
) -> Vec<Portion> {
    let fits = |groups: &Groups| size(groups, sizes) <= MAX_GROUPS;
    let mut portions: Vec<Portion> = Vec::new();
    let mut open = Portion {
        primitives: 0..primitives,
        draws: vec![Groups::new()],
    };
    for (&primitive, quads) in quads {
        let own: Groups = quads.iter().flatten().copied().collect();
        let joined = &open.draws[0] | &own;
        if open.draws.len() == 1 && fits(&joined) {
            open.draws[0] = joined;
            continue;
        }
        let draws = if fits(&own) {
            vec![own]
        } else {
            draws_of(quads, sizes)
        };
        if primitive > open.primitives.start {
            open.primitives.end = primitive;
            portions.push(open);
        }
        open = Portion {
            primitives: primitive..primitives,
            draws,
        };
    }
    portions.push(open);
    portions
}

/// Draws of one primitive. A quad that needs too many groups by itself is divided, and only such a quad.
fn draws_of(quads: &BTreeSet<Groups>, sizes: &BTreeMap<GroupKey, usize>) -> Vec<Groups> {
    let fits = |groups: &Groups| size(groups, sizes) <= MAX_GROUPS;
    let mut draws: Vec<Groups> = Vec::new();
    let mut place = |groups: &Groups| match draws.iter_mut().find(|draw| fits(&(&**draw | groups)))
    {
        Some(draw) => draw.extend(groups),
        None => draws.push(groups.clone()),
    };
    for quad in quads {
        if fits(quad) {
            place(quad);
        } else {
            for key in quad {
                place(&Groups::from([*key]));
            }
        }
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;

    fn groups(of: &[u16]) -> Groups {
        of.iter().map(|group| (*group, None)).collect()
    }

    /// Portions of primitives, each by the groups of its quads.
    fn divided(quads: &[&[&[u16]]], primitives: u32) -> Vec<(Range<u32>, Vec<Groups>)> {
        let of_primitives = (0..).zip(quads).map(|(primitive, quads)| {
            let of: BTreeSet<Groups> = quads.iter().map(|quad| groups(quad)).collect();
            (primitive, of)
        });
        let sizes = (0..100).map(|group| ((group, None), 1)).collect();
        let portions = portions(&of_primitives.collect(), &sizes, primitives);
        portions
            .into_iter()
            .map(|portion| (portion.primitives, portion.draws))
            .collect()
    }

    #[test]
    fn sprites_with_a_texture_each_are_ranges_of_primitives() {
        let quads: Vec<Vec<u16>> = (0..20).map(|group| vec![group]).collect();
        let of: Vec<[&[u16]; 1]> = quads.iter().map(|quad| [quad.as_slice()]).collect();
        let of: Vec<&[&[u16]]> = of.iter().map(<[_; 1]>::as_slice).collect();
        let [first, rest] = [0..15, 15..20].map(|of| groups(&of.collect::<Vec<_>>()));
        assert_eq!(
            divided(&of, 30),
            [(0..15, vec![first]), (15..30, vec![rest])]
        );
    }

    #[test]
    fn each_quad_of_a_primitive_with_many_branches_is_in_one_draw() {
        let quads: Vec<Vec<u16>> = (0..16)
            .flat_map(|group| [vec![group], vec![group, group + 1]])
            .collect();
        let of: Vec<&[u16]> = quads.iter().map(Vec::as_slice).collect();
        let portions = divided(&[&[&[0]], &of, &[&[3]]], 3);
        let ranges: Vec<_> = portions.iter().map(|(range, _)| range.clone()).collect();
        assert_eq!(ranges, [0..1, 1..2, 2..3]);
        let draws = &portions[1].1;
        assert_eq!(draws.len(), 2);
        assert!(draws.iter().all(|draw| draw.len() <= MAX_GROUPS));
        for quad in &quads {
            let quad = groups(quad);
            assert!(draws.iter().any(|draw| draw.is_superset(&quad)), "{quad:?}");
        }
    }

    #[test]
    fn only_a_quad_with_too_many_groups_is_divided() {
        let many: Vec<u16> = (0..25).collect();
        let portions = divided(&[&[&many]], 1);
        let draws = &portions[0].1;
        assert_eq!(draws.len(), 2);
        assert_eq!(draws.iter().map(BTreeSet::len).sum::<usize>(), 25);
    }

    #[test]
    fn draws_without_records_are_whole() {
        assert_eq!(divided(&[], 7), [(0..7, vec![groups(&[])])]);
    }
}
