// Pictures for the pages' materials, drawn by number: no file is needed, and every run has the same.

// A canvas of a pattern: `kind` is bricks, planks, tiles or marble.
export function pattern(kind, size, hue) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const to = canvas.getContext("2d");
  let seed = hue * 7919 + kind.length;
  const random = () => {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    return seed / 4294967296;
  };
  const color = (light) => `hsl(${hue + 20 * random()}, 50%, ${light + 12 * random()}%)`;
  to.fillStyle = color(25);
  to.fillRect(0, 0, size, size);
  const rows = kind === "planks" ? 8 : 16;
  const height = size / rows;
  for (let row = 0; row < rows; row++) {
    const columns = { bricks: 8, planks: 2, tiles: 16, marble: 1 }[kind];
    const width = size / columns;
    const shift = kind === "bricks" && row % 2 ? width / 2 : 0;
    for (let column = -1; column < columns + 1; column++) {
      to.fillStyle = color(kind === "marble" ? 60 : 40);
      to.fillRect(column * width + shift + 2, row * height + 2, width - 4, height - 4);
    }
  }
  for (let speck = 0; speck < size * 8; speck++) {
    to.fillStyle = `rgba(${random() < 0.5 ? 0 : 255}, 128, 64, 0.15)`;
    to.fillRect(random() * size, random() * size, 2, 2);
  }
  return canvas;
}

// A canvas of normals that wave by so many periods.
export function waves(size, periods) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const to = canvas.getContext("2d");
  const image = to.createImageData(size, size);
  for (let y = 0; y < size; y++) {
    for (let x = 0; x < size; x++) {
      const phase = (2 * Math.PI * periods) / size;
      const at = 4 * (y * size + x);
      image.data[at] = 128 + 60 * Math.cos(phase * x);
      image.data[at + 1] = 128 + 60 * Math.cos(phase * y);
      image.data[at + 2] = 230;
      image.data[at + 3] = 255;
    }
  }
  to.putImageData(image, 0, 0);
  return canvas;
}

// What stands in the room: kind of shape, place, size, pattern, hue.
export const THINGS = [];
for (let i = 0; i < 24; i++) {
  const ring = i < 8 ? 3 : i < 16 ? 5 : 7.5;
  const angle = (2 * Math.PI * (i % 8)) / 8 + ring;
  THINGS.push({
    shape: ["box", "sphere", "knot", "cylinder"][i % 4],
    place: [ring * Math.cos(angle), 0.7 + 0.5 * (i % 3), ring * Math.sin(angle)],
    size: 0.6 + 0.1 * (i % 5),
    pattern: ["bricks", "planks", "tiles", "marble"][(i * 7) % 4],
    hue: (i * 47) % 360,
  });
}
