// What a quad covers, and its records.

// Where a fragment lies in its quad, and what it belongs to.
struct Lane {
    // Quad column and row, 12 bits each.
    quad: u32,
    // 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    index: u32,
    // First bit of the quad in a ballot.
    shift: u32,
    primitive: u32,
    draw: u32,
    // Lanes of the quad whose alpha passes, told of alpha-masked draws alone; above them what tells the
    // quads of a clipped primitive apart where fragments are recorded alone.
    passing: u32,
}

fn lane_at(in: Fragment, primitive: u32, invocation: u32) -> Lane {
    let pixel = vec2<u32>(in.position.xy);
    var lane: Lane;
    lane.quad = (pixel.x >> 1u) | ((pixel.y >> 1u) << 12u);
    lane.index = (pixel.x & 1u) | ((pixel.y & 1u) << 1u);
    lane.shift = invocation & 4u;
    lane.primitive = in.ids.y + primitive;
    lane.draw = in.ids.x;
    return lane;
}

// Appends a record and tells its index. Software rasterisers store lane by lane: four words at once
// cost them little more than one.
fn append(lane: Lane, mask: u32, group: u32, a: vec4<f32>, b: vec4<f32>) -> u32 {
    let index = atomicAdd(&counter, 1u);
    if index < views[view_number].counts.y {
        let first = index * RECORD_VECTORS;
        let header = lane.quad | (mask << 24u) | (group << 28u);
        records[first] = vec4(header, lane.primitive, lane.draw, lane.passing);
        records[first + 1u] = bitcast<vec4<u32>>(a);
        records[first + 2u] = bitcast<vec4<u32>>(b);
    }
    return index;
}

// Tells the record's index to the lane that appended it. Must be called in uniform control flow:
// the derivatives need the helper lanes.
fn record_uv(lane: Lane, group: u32, takes: bool, uv: vec2<f32>) -> u32 {
    let dx = dpdx(uv);
    let dy = dpdy(uv);
    let cross = dpdx(dy);
    let mask = quad_mask(lane, takes);
    var index = NONE;
    if takes && firstTrailingBit(mask) == lane.index {
        // Back from this lane to the top-left one, the top row and the left column.
        let right = f32(lane.index & 1u);
        let down = f32(lane.index >> 1u);
        let dx_top = dx - down * cross;
        let dy_left = dy - right * cross;
        let top_left = uv - right * dx_top - down * dy_left - right * down * cross;
        index = append(lane, mask, group, vec4(top_left, dx_top), vec4(dy_left, cross));
    }
    return index;
}

// One record a uv group of the material; tells the index of group 0's.
fn record_material(lane: Lane, in: Fragment) -> u32 {
    if LEADERS == 0u && CASCADES == 0u {
        let mask = quad_mask(lane, true);
        if firstTrailingBit(mask) == lane.index {
            _ = append(lane, mask, NO_GROUP, vec4(0.0), vec4(0.0));
        }
    }
    return record_groups(lane, in);
}

// Depth of the four lanes, for the in-order replay; `index` is that of the quad's record in group 0.
fn record_depth(lane: Lane, index: u32, depth: f32) {
    let dx = dpdx(depth);
    let dy = dpdy(depth);
    let cross = dpdx(dy);
    if index < views[view_number].counts.y {
        let right = f32(lane.index & 1u);
        let down = f32(lane.index >> 1u);
        let dx_top = dx - down * cross;
        let dy_left = dy - right * cross;
        let top_left = depth - right * dx_top - down * dy_left - right * down * cross;
        let top = vec2(top_left, top_left + dx_top);
        let bottom = top + vec2(dy_left, dy_left + cross);
        depths[index] = vec4(top, bottom);
    }
}

fn record_shadow(lane: Lane, found: ShadowLookup) {
    let first = countOneBits(LEADERS);
    let cascades = cascades_near(found.cascade);
    for (var k = cascades.x; k <= cascades.y; k++) {
        var uv = vec2(0.0);
        // With constants for indices the array stays in registers.
        for (var c = 0u; c < CASCADES; c++) {
            uv = select(uv, found.uv[c], u32(k) == c);
        }
        _ = record_uv(lane, first + u32(k), found.cascade == k, uv);
    }
    // Lanes outside every cascade sample nothing; without a texture they still count.
    if LEADERS == 0u {
        let alone = found.cascade < 0;
        let mask = quad_mask(lane, alone);
        if alone && firstTrailingBit(mask) == lane.index {
            _ = append(lane, mask, NO_GROUP, vec4(0.0), vec4(0.0));
        }
    }
}
