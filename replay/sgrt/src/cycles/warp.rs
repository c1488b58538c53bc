//! Rays in lock step. A warp takes one node or triangle per step, and all rays whose next request is that one take
//! part. The warp therefore has a single sequence of requests, which contains each ray's own sequence.

use super::batch::Request;
use std::cmp::Reverse;
use std::collections::HashMap;

/// Merges the requests of a warp's rays and appends the result to `out`. Each step takes, of the rays' next requests, the
/// one that the fewest other rays reach only later, so that rays rejoin; of these, the one that most rays have next, and
/// then that of the first ray.
pub fn merge(rays: &[&[Request]], out: &mut Vec<Request>) {
    if let [only] = rays {
        out.extend_from_slice(only);
        return;
    }
    let mut next = vec![0usize; rays.len()];
    // Rays that have a request ahead of them.
    let mut ahead: HashMap<Request, u32> = HashMap::new();
    for request in rays.iter().flat_map(|ray| *ray) {
        *ahead.entry(*request).or_default() += 1;
    }
    let mut votes: Vec<(Request, u32)> = Vec::with_capacity(rays.len());
    loop {
        votes.clear();
        for (ray, at) in rays.iter().zip(&next) {
            let Some(request) = ray.get(*at) else {
                continue;
            };
            match votes.iter_mut().find(|(other, _)| other == request) {
                Some((_, count)) => *count += 1,
                None => votes.push((*request, 1)),
            }
        }
        let cost = |&&(request, count): &&(Request, u32)| {
            let later = ahead
                .get(&request)
                .map_or(0, |all| all.saturating_sub(count));
            (later, Reverse(count))
        };
        let Some(&(chosen, count)) = votes.iter().min_by_key(cost) else {
            return;
        };
        out.push(chosen);
        if let Some(all) = ahead.get_mut(&chosen) {
            *all -= count;
        }
        for (ray, at) in rays.iter().zip(&mut next) {
            *at += usize::from(ray.get(*at) == Some(&chosen));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::batch::Pipeline;
    use super::*;

    fn path(lines: &[u32]) -> Vec<Request> {
        let request = |&first_line: &u32| Request {
            first_line,
            lines: 1,
            pipeline: Pipeline::Traversal,
        };
        lines.iter().map(request).collect()
    }

    fn merged(rays: &[&[u32]]) -> Vec<u32> {
        let paths: Vec<Vec<Request>> = rays.iter().map(|ray| path(ray)).collect();
        let slices: Vec<&[Request]> = paths.iter().map(Vec::as_slice).collect();
        let mut out = Vec::new();
        merge(&slices, &mut out);
        out.iter().map(|request| request.first_line).collect()
    }

    #[test]
    fn equal_rays_cost_one_ray_and_disjoint_rays_cost_their_sum() {
        assert_eq!(merged(&[&[1, 2, 3], &[1, 2, 3]]), [1, 2, 3]);
        assert_eq!(merged(&[&[1, 2], &[3, 4]]), [1, 2, 3, 4]);
        assert_eq!(merged(&[&[7, 8]]), [7, 8]);
        assert_eq!(merged(&[&[], &[]]), [0; 0]);
    }

    #[test]
    fn rays_rejoin_after_a_detour() {
        assert_eq!(merged(&[&[1, 5, 9], &[1, 2, 9], &[1, 2, 9]]), [1, 2, 5, 9]);
    }
}
