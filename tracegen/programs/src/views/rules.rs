//! Rules for common ways of rendering for two eyes.

use super::{DrawKey, Drawn, Found, LEFT, RIGHT, Role, Rule, View, viewport};
use crate::pairs::matched_share;
use spool::ViewInfo;
use std::collections::HashMap;

/// Applies a rule. `None` if it does not fit.
pub(super) fn find(rule: Rule, draws: &[Drawn<'_>]) -> Option<Found> {
    match rule {
        Rule::Multiview => multiview(draws),
        Rule::Halves => halves(draws),
        Rule::Targets => targets(draws),
        Rule::Channels => channels(draws),
        Rule::Twice => twice(draws),
        Rule::Mono => mono(draws),
        Rule::File | Rule::Shown => None,
    }
}

/// Sums the fragments of draws by a key; the largest sum comes first.
fn sums_by_key<K: Copy + Eq + std::hash::Hash>(
    draws: &[&Drawn<'_>],
    key: impl Fn(&Drawn<'_>) -> Option<K>,
) -> Vec<(K, u64)> {
    let mut order: Vec<K> = Vec::new();
    let mut sums: HashMap<K, u64> = HashMap::new();
    for draw in draws {
        if let Some(key) = key(draw) {
            if !sums.contains_key(&key) {
                order.push(key);
            }
            *sums.entry(key).or_default() += draw.weight;
        }
    }
    let mut found: Vec<(K, u64)> = order.into_iter().map(|key| (key, sums[&key])).collect();
    // Keys with equal sums stay in drawing order.
    found.sort_by_key(|(_, weight)| std::cmp::Reverse(*weight));
    found
}

fn all<'a, 'b>(draws: &'b [Drawn<'a>]) -> Vec<&'b Drawn<'a>> {
    draws.iter().collect()
}

fn multiview(draws: &[Drawn<'_>]) -> Option<Found> {
    let broadcast = |draw: &Drawn<'_>| {
        let mask = draw.pass?.view_mask;
        let target = draw.target()?;
        (mask.count_ones() == 2).then_some((target.image, mask, viewport(draw.info)))
    };
    let ((image, mask, view), weight) = *sums_by_key(&all(draws), broadcast).first()?;
    let of = draws
        .iter()
        .filter(|draw| broadcast(draw).is_some_and(|(other, of, _)| (other, of) == (image, mask)));
    let first = mask.trailing_zeros();
    Some(Found {
        eyes: [view; 2],
        layers: [first, (mask & (mask - 1)).trailing_zeros()],
        roles: of.map(|draw| (draw.place, Role::Multiview)).collect(),
        weight,
    })
}

/// Whether two rectangles are side by side or one above the other.
fn are_halves(a: View, b: View) -> bool {
    if a.size != b.size || a.size.contains(&0) {
        return false;
    }
    let [dx, dy] = [0, 1].map(|axis| (a.origin[axis] - b.origin[axis]).unsigned_abs());
    let [width, height] = a.size;
    // The gap between them may be up to a tenth of their size.
    let beside = dy == 0 && dx >= width && dx - width <= width / 10;
    let above = dx == 0 && dy >= height && dy - height <= height / 10;
    beside || above
}

fn halves(draws: &[Drawn<'_>]) -> Option<Found> {
    let place = |draw: &Drawn<'_>| Some((draw.target()?, viewport(draw.info)));
    let places = sums_by_key(&all(draws), place);
    for ((target, view), weight) in &places {
        let other = places
            .iter()
            .find(|((other, of), _)| other == target && are_halves(*view, *of));
        let Some(((_, of), other_weight)) = other else {
            continue;
        };
        let mut eyes = [*view, *of];
        eyes.sort_by_key(|view| view.origin);
        let role = |draw: &Drawn<'_>| {
            let (on, view) = place(draw)?;
            let eye = eyes.iter().position(|eye| on == *target && *eye == view)?;
            Some((draw.place, [LEFT, RIGHT][eye]))
        };
        return Some(Found {
            eyes,
            layers: [0, 1],
            roles: draws.iter().filter_map(role).collect(),
            weight: weight + other_weight,
        });
    }
    None
}

/// Required share of draws that both eyes have in common.
const LEAST_MATCHED_SHARE: f64 = 0.7;

fn targets(draws: &[Drawn<'_>]) -> Option<Found> {
    let on = |draw: &Drawn<'_>| draw.target();
    let places = sums_by_key(&all(draws), on);
    let keys = |target: ViewInfo| -> Vec<DrawKey> {
        let of = draws.iter().filter(|draw| on(draw) == Some(target));
        of.map(|draw| DrawKey::of(draw.info)).collect()
    };
    let main = |target: ViewInfo| {
        let of: Vec<&Drawn<'_>> = draws
            .iter()
            .filter(|draw| on(draw) == Some(target))
            .collect();
        sums_by_key(&of, |draw| Some(viewport(draw.info)))
            .first()
            .map(|(view, _)| *view)
    };
    for (number, (a, weight)) in places.iter().enumerate() {
        for (b, other_weight) in &places[number + 1..] {
            let (Some(of_a), Some(of_b)) = (main(*a), main(*b)) else {
                continue;
            };
            let alike = a.format == b.format
                && of_a.size == of_b.size
                && matched_share(&keys(*a), &keys(*b)) >= LEAST_MATCHED_SHARE;
            if !alike || *other_weight * 4 < *weight {
                continue;
            }
            let first = draws.iter().filter_map(on).find(|t| t == a || t == b);
            let [left, right] = if first == Some(*b) {
                [*b, *a]
            } else {
                [*a, *b]
            };
            let role = |draw: &Drawn<'_>| match on(draw)? {
                target if target == left => Some((draw.place, LEFT)),
                target if target == right => Some((draw.place, RIGHT)),
                _ => None,
            };
            return Some(Found {
                eyes: [left, right].map(|target| main(target).unwrap_or_default()),
                layers: [0, 1],
                roles: draws.iter().filter_map(role).collect(),
                weight: weight + other_weight,
            });
        }
    }
    None
}

/// The draws into the target with the most fragments, and their main viewport.
fn main_target<'a, 'b>(draws: &'b [Drawn<'a>]) -> Option<(Vec<&'b Drawn<'a>>, View, u64)> {
    let (target, weight) = *sums_by_key(&all(draws), |draw| draw.target()).first()?;
    let of: Vec<&Drawn<'_>> = draws
        .iter()
        .filter(|draw| draw.target() == Some(target))
        .collect();
    let (view, _) = *sums_by_key(&of, |draw| Some(viewport(draw.info))).first()?;
    Some((of, view, weight))
}

fn channels(draws: &[Drawn<'_>]) -> Option<Found> {
    const COLORS: u32 = 7;
    let (of, view, _) = main_target(draws)?;
    let seen = |draw: &&Drawn<'_>| draw.channels() & COLORS;
    let mut order: Vec<u32> = of
        .iter()
        .map(seen)
        .filter(|c| *c != 0 && *c != COLORS)
        .collect();
    order.dedup();
    let left = *order.first()?;
    let right = *order.iter().find(|other| **other & left == 0)?;
    let of_channels = |draw: &&&Drawn<'_>| [left, right].contains(&seen(draw));
    let roles = of.iter().filter(of_channels).map(|draw| {
        let eye = if seen(draw) == left { LEFT } else { RIGHT };
        (draw.place, eye)
    });
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: roles.collect(),
        weight: of.iter().filter(of_channels).map(|draw| draw.weight).sum(),
    })
}

fn twice(draws: &[Drawn<'_>]) -> Option<Found> {
    let (of, view, weight) = main_target(draws)?;
    let keys: Vec<DrawKey> = of.iter().map(|draw| DrawKey::of(draw.info)).collect();
    // The second eye starts with a render pass.
    let starts = (1..of.len())
        .filter(|at| of[*at].pass.map(|pass| pass.pass) != of[*at - 1].pass.map(|pass| pass.pass));
    let alike = starts.map(|at| (at, matched_share(&keys[..at], &keys[at..])));
    let best = alike.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (middle, _) = Some(best).filter(|(_, share)| *share >= LEAST_MATCHED_SHARE)?;
    let roles = of.iter().enumerate().map(|(number, draw)| {
        let eye = if number < middle { LEFT } else { RIGHT };
        (draw.place, eye)
    });
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: roles.collect(),
        weight,
    })
}

fn mono(draws: &[Drawn<'_>]) -> Option<Found> {
    let (of, view, weight) = main_target(draws)?;
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: of
            .iter()
            .map(|draw| (draw.place, Role::Seen(None)))
            .collect(),
        weight,
    })
}
