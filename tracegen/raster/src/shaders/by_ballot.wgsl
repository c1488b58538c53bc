// Quads are recorded whole: a ballot tells their lanes what they cover, and the first of them writes.

struct Place {
    @builtin(front_facing) front: bool,
    @builtin(primitive_index) primitive: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
}

fn primitive_of(place: Place) -> u32 {
    return place.primitive;
}

fn lane_of(in: Fragment, place: Place) -> Lane {
    return lane_at(in, primitive_of(place), place.invocation);
}

// Lanes of the quad for which `takes` holds; helper lanes never vote.
fn quad_mask(lane: Lane, takes: bool) -> u32 {
    return (subgroupBallot(takes).x >> lane.shift) & 15u;
}

// First and last cascade to visit. Almost every subgroup lies in one: those between its nearest and
// farthest. The bounds are the same for all its lanes, so that control flow stays uniform.
fn cascades_near(cascade: i32) -> vec2<i32> {
    return vec2(subgroupMin(select(cascade, 99, cascade < 0)), subgroupMax(cascade));
}
