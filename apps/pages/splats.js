// A room of Gaussian splats in the layout of `.splat` files: position and scale (3 float32 each), colour and rotation (4 uint8 each).

const BYTES = 32;

// Numbers in 0..1 that follow the seed (mulberry32).
const numbers = (seed) => () => {
  seed = (seed + 0x6d2b79f5) | 0;
  let mixed = Math.imul(seed ^ (seed >>> 15), 1 | seed);
  mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
  return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
};

export function room(count) {
  const random = numbers(1);
  const data = new DataView(new ArrayBuffer(count * BYTES));
  for (let splat = 0; splat < count; splat++) {
    const at = splat * BYTES;
    let place, color;
    if (splat % 4 === 0) {
      place = [8 * random() - 4, 0, 8 * random() - 6];
      color = (Math.floor(place[0]) + Math.floor(place[2])) & 1 ? [210, 200, 180] : [90, 110, 140];
    } else {
      // A sphere's points are uniform in height and in the angle around it.
      const ball = splat % 12;
      const [up, angle] = [2 * random() - 1, 2 * Math.PI * random()];
      const around = 0.35 * Math.sqrt(1 - up * up);
      place = [(ball % 4) - 1.5 + around * Math.cos(angle), 0.6 + Math.floor(ball / 4) * 0.8 + 0.35 * up, -2 - (ball % 3) + around * Math.sin(angle)];
      color = [60 + 16 * ball, 220 - 14 * ball, 120 + 60 * up];
    }
    place.forEach((value, axis) => data.setFloat32(at + 4 * axis, value, true));
    for (let axis = 0; axis < 3; axis++) data.setFloat32(at + 12 + 4 * axis, 0.008 + 0.02 * random(), true);
    [...color, 130 + 120 * random()].forEach((value, channel) => data.setUint8(at + 24 + channel, value));
    for (let part = 0; part < 4; part++) data.setUint8(at + 28 + part, 255 * random());
  }
  return data.buffer;
}
