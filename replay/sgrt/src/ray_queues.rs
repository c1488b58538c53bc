//! Queues of rays at treelets (Aila and Karras, "Architecture Considerations for Tracing Incoherent Rays", HPG 2010): units go
//! on with the rays of a batch that wait for the same treelet.
//!
//! A treelet is a block of the memory of nodes, so traces with `--treelets` of that size have connected ones. A leaf belongs
//! to the treelet of its node. The rays' state stays on the chip.

use super::hardware::RayTurn;
use formats::raytrace::Visit;
use std::collections::BTreeMap;

/// The turns of a batch, cut where a ray visits a node of another treelet. The treelet for which most rays wait comes next,
/// of equal ones the first in memory. Rays leave a queue in the order in which they came.
pub(super) fn queued<'a>(
    turns: Vec<RayTurn<'a>>,
    treelet_of: impl Fn(u32) -> u64,
) -> Vec<RayTurn<'a>> {
    let treelet = |visit: &Visit| match visit {
        Visit::Node(node) => Some(treelet_of(*node)),
        Visit::Triangle(_) => None,
    };
    let (mut queues, mut out) = (BTreeMap::<u64, Vec<RayTurn<'a>>>::new(), Vec::new());
    for turn in turns {
        let first = turn.visits.first().and_then(treelet).unwrap_or(0);
        queues.entry(first).or_default().push(turn);
    }
    while let Some((&here, _)) = queues.iter().rev().max_by_key(|(_, rays)| rays.len()) {
        for turn in queues.remove(&here).into_iter().flatten() {
            let elsewhere = |visit: &Visit| treelet(visit).is_some_and(|of| of != here);
            let end = turn.visits.iter().position(elsewhere);
            let (visits, rest) = turn.visits.split_at(end.unwrap_or(turn.visits.len()));
            out.push(RayTurn { visits, ..turn });
            if let Some(next) = rest.first().and_then(treelet) {
                let rest = RayTurn {
                    visits: rest,
                    is_first: false,
                    ..turn
                };
                queues.entry(next).or_default().push(rest);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use Visit::{Node, Triangle};
    use formats::raytrace::RayRecord;
    use sim::order::TileRef;

    #[test]
    fn rays_wait_for_their_treelet_and_keep_their_visits() {
        // Treelets of ten nodes.
        let visits: [&[Visit]; 4] = [
            &[Node(0), Node(11), Triangle(5), Node(12), Node(1)],
            &[Node(0), Node(21), Node(13)],
            &[Node(2), Node(14), Triangle(6)],
            &[],
        ];
        let ray = RayRecord::default();
        let turn = |sample: usize| RayTurn {
            at: TileRef { pass: 0, tile: 0 },
            sample,
            unit: 0,
            ray: &ray,
            is_first: true,
            visits: visits[sample],
            geometry: None,
        };
        let turns = queued((0..4).map(turn).collect(), |node| u64::from(node) / 10);
        let found: Vec<_> = turns
            .iter()
            .map(|turn| (turn.sample, turn.visits))
            .collect();
        let expected: [(usize, &[Visit]); 8] = [
            (0, &[Node(0)]),
            (1, &[Node(0)]),
            (2, &[Node(2)]),
            (3, &[]),
            // Two rays wait for the second treelet, then one for each.
            (0, &[Node(11), Triangle(5), Node(12)]),
            (2, &[Node(14), Triangle(6)]),
            (0, &[Node(1)]),
            (1, &[Node(21)]),
        ];
        assert_eq!(found[..8], expected);
        assert_eq!(found[8..], [(1, &[Node(13)][..])]);
        assert_eq!(turns.iter().filter(|turn| turn.is_first).count(), 4);
    }
}
