// The driver numbers the primitives of a draw.

struct Place {
    @builtin(front_facing) front: bool,
    @builtin(primitive_index) primitive: u32,
}

fn primitive_of(place: Place) -> u32 {
    return place.primitive;
}
