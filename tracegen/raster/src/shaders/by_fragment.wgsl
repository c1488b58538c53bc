// Fragments are recorded alone, as if each were all that its quad covers; the host merges them (see
// record::Merged). For drivers without ballots, or with unsound ones.

fn lane_of(in: Fragment, place: Place) -> Lane {
    var lane = lane_at(in, primitive_of(place), 0u);
    lane.passing = quad_tag(in) << 4u;
    return lane;
}

fn quad_mask(lane: Lane, takes: bool) -> u32 {
    return select(0u, 1u << lane.index, takes);
}

fn cascades_near(cascade: i32) -> vec2<i32> {
    return vec2(0, i32(CASCADES) - 1);
}

fn mix_bits(hash: u32, value: f32) -> u32 {
    let mixed = (hash ^ bitcast<u32>(value)) * 0x9e3779b1u;
    return mixed ^ (mixed >> 15u);
}

// A number for all four lanes of a quad, covered or not. What clipping cuts a primitive into is
// interpolated each for itself and differs in the last bits, and so does the number.
fn quad_tag(in: Fragment) -> u32 {
    var hash = mix_bits(0u, in.position.z);
    hash = mix_bits(hash, in.position.w);
    hash = mix_bits(hash, in.world.x);
    hash = mix_bits(hash, in.world.y);
    hash = mix_bits(hash, in.world.z);
    hash = mix_bits(hash, in.uv.x);
    hash = mix_bits(hash, in.uv.y);
    // Sums and differences of four such numbers are exact, so every lane finds the same one.
    let exact = f32(hash >> 10u);
    return bitcast<u32>(i32(dpdx(dpdy(exact)))) & 0x0fffffffu;
}
