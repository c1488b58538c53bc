// Fragment entry points that record what they sample.

// Everything that a fragment of an opaque or blended draw does.
fn capture_and_shade(in: Fragment, place: Place) -> vec4<f32> {
    let front = place.front;
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    let found = find_cascade(in.world, geometric);
    if CAPTURE {
        let lane = lane_of(in, place);
        _ = record_material(lane, in);
        if CASCADES > 0u { record_shadow(lane, found); }
    }
    return shade(in, front, base_color(in), found);
}

// What a fragment samples, recorded by a draw that shades nothing; tells the index of group 0's record.
fn record_lit(lane: Lane, in: Fragment, front: bool) -> u32 {
    let index = record_material(lane, in);
    if CASCADES > 0u {
        let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
        record_shadow(lane, find_cascade(in.world, geometric));
    }
    return index;
}

@fragment @early_depth_test(force)
fn fragment_early(in: Fragment, place: Place) -> @location(0) vec4<f32> {
    return capture_and_shade(in, place);
}

// Records of all of a draw that the pass's depth leaves, in a draw of its own.
@fragment @early_depth_test(force)
fn fragment_record(in: Fragment, place: Place) -> @location(0) vec4<f32> {
    let lane = lane_of(in, place);
    _ = record_lit(lane, in, place.front);
    return vec4(0.0);
}

// Records of an alpha-masked draw. Forced early depth with a discard would write the depth of
// discarded fragments, so a draw of its own records them and writes neither colour nor depth.
@fragment @early_depth_test(force)
fn fragment_masked_record(in: Fragment, place: Place) -> @location(0) vec4<f32> {
    var lane = lane_of(in, place);
    lane.passing |= quad_mask(lane, base_alpha(in) >= material.specular.w);
    let index = record_lit(lane, in, place.front);
    record_depth(lane, index, in.position.z);
    return vec4(0.0);
}

// Fragments per pixel by additive blending (a check of the records).
@fragment @early_depth_test(force)
fn fragment_count() -> @location(0) vec4<f32> {
    return vec4(1.0);
}

// Marks a draw as visible, and as visible through the lens. Whoever writes a word writes the same.
fn mark(in: Fragment) {
    marks[2u * in.ids.x] = 1u;
    let from_center = (in.position.xy - views[view_number].lens.xy) * views[view_number].lens.zw;
    if dot(from_center, from_center) <= 1.0 { marks[2u * in.ids.x + 1u] = 1u; }
}

@fragment @early_depth_test(force)
fn fragment_mark(in: Fragment) {
    mark(in);
}

@fragment @early_depth_test(force)
fn fragment_mark_masked(in: Fragment) {
    if base_alpha(in) >= material.specular.w { mark(in); }
}
