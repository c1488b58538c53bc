// Maps of tiles. Pictures of one pixel per tile are scaled up, so that a picture of a whole frame costs a few
// milliseconds.
const canvases = [...root.querySelectorAll("canvas.map")];
const ramp = Uint32Array.from({ length: 256 }, (_, at) => word(rgb(data.ramp.slice(6 * at, 6 * at + 6))));
const NOW = word([0xd5, 0x5e, 0x00]), TRAIL = 24;

// Values of all tiles of the frame, and the end of the colour scale, which all orders share.
let values, most;
const updateMaps = () => {
  const [, , of] = metrics[state.metric], part = state.part;
  if (isL2()) most = 100;
  else {
    values = frame().passes.map(pass => pass.runs.map(run => {
      const out = new Float64Array(pass.footprints.length);
      if (part) for (const [tile, count] of pass.parts[part.kind].get(part.index) || []) out[tile] = count;
      else for (let tile = 0; tile < out.length; tile++) out[tile] = of(pass, run, tile);
      return out;
    }));
    most = values.flat().reduce((most, list) => list.reduce((a, b) => Math.max(a, b), most), 0) || 1;
  }
  const unit = part ? (part.kind === "draw" ? "quads" : "lines") : metrics[state.metric][1];
  $("most").textContent = isL2() ? `100 ${unit}` : `${digits(most)} ${unit} in a tile`;
  const missed = root.querySelector(".missed");
  if (missed) missed.hidden = !isL2();
  request();
};

const inks = {};
const readInks = () => {
  const style = getComputedStyle(root);
  for (const name of ["fg", "bg", "muted", "line", "soft"]) inks[name] = style.getPropertyValue(`--${name}`).trim();
  const [r, g, b] = inks.soft.length === 4 ? [1, 2, 3].map(at => 17 * parseInt(inks.soft[at], 16)) : rgb(inks.soft.slice(1));
  inks.waits = word([r, g, b]);
};

// Places of the passes: two in a row, below their names.
const NAME = 18, GAP = 10;
const places = width => {
  const passes = frame().passes, out = [];
  let y = 0;
  for (let at = 0; at < passes.length; at += 2) {
    const row = passes.slice(at, at + 2);
    const cell = (width - GAP * (row.length - 1)) / row.reduce((sum, pass) => sum + pass.tiles[0], 0);
    let x = 0;
    for (const pass of row) {
      const [w, h] = pass.tiles.map(tiles => tiles * cell);
      out.push({ x, y: y + NAME, w, h, cell });
      x += w + GAP;
    }
    y += NAME + Math.max(...row.map(pass => pass.tiles[1])) * cell + GAP;
  }
  return { list: out, height: Math.ceil(y) };
};
const fit = (canvas, height, width = canvas.clientWidth) => {
  const scale = devicePixelRatio || 1;
  const size = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== size[0] || canvas.height !== size[1]) {
    [canvas.width, canvas.height] = size;
    canvas.style.height = `${height}px`;
  }
  const ink = canvas.getContext("2d");
  ink.setTransform(scale, 0, 0, scale, 0, 0);
  ink.clearRect(0, 0, width, height);
  ink.font = "12px system-ui, sans-serif";
  return ink;
};

const picture = data.picture && Object.assign(new Image(), { src: data.picture, onload: () => request() });
const fillWords = (pass, at, number, now) => {
  const { start, end, in_l2 } = pass.runs[number];
  const shares = isL2() && in_l2[stepOf(frame().runs[number])], shown = !shares && values[at][number];
  for (let tile = 0; tile < pass.words.length; tile++) {
    const isNow = start[tile] <= now && end[tile] > now;
    pass.words[tile] = isNow ? NOW
      : shares ? ramp[255 * shares[tile] / data.full | 0]
      : start[tile] > now ? inks.waits
      : ramp[Math.min(255, 255 * shown[tile] / most | 0)];
  }
};
// Cells of this width in pixels have lines between them.
const WIDE = 7;
// What stays the same is drawn once: picture and names below the tiles, the grid above them.
const isShown = pass => picture && picture.complete && pass.eye !== null;
const drawStill = (canvas, { list, height }) => {
  const key = [canvas.clientWidth, state.frame, inks.fg, devicePixelRatio, isShown(frame().passes[0])].join();
  if (canvas.key === key) return;
  canvas.key = key;
  // A canvas costs time in each picture, even if nothing is drawn on it.
  const above = canvas.parentNode.lastChild;
  above.hidden = list.every(({ cell }) => cell < WIDE);
  const ink = fit(canvas, height), grid = fit(above, height);
  grid.strokeStyle = inks.line;
  grid.globalAlpha = 0.25;
  frame().passes.forEach((pass, at) => {
    const { x, y, w, h, cell } = list[at], half = isShown(pass) && picture.naturalWidth / 2;
    if (half) ink.drawImage(picture, pass.eye * half, 0, half, picture.naturalHeight, x, y, w, h);
    ink.fillStyle = inks.fg;
    ink.fillText(pass.name, x, y - 5);
    if (cell < WIDE) return;
    grid.beginPath();
    for (let column = 1; column < pass.tiles[0]; column++) grid.rect(x + column * cell, y, 0, h);
    for (let row = 1; row < pass.tiles[1]; row++) grid.rect(x, y + row * cell, w, 0);
    grid.stroke();
  });
};
const drawRun = (canvas, number) => {
  const all = places(canvas.clientWidth), { list, height } = all;
  drawStill(canvas.previousSibling, all);
  const ink = fit(canvas, height), run = frame().runs[number], now = clock(run);
  ink.imageSmoothingEnabled = false;
  frame().passes.forEach((pass, at) => {
    const { x, y, w, h } = list[at];
    fillWords(pass, at, number, now);
    pass.small.getContext("2d").putImageData(pass.image, 0, 0);
    ink.globalAlpha = isShown(pass) ? 0.72 : 1;
    ink.drawImage(pass.small, x, y, w, h);
    ink.globalAlpha = 1;
    ink.strokeStyle = inks.line;
    ink.strokeRect(x, y, w, h);
  });
  const centre = ({ pass, tile }) => {
    const { x, y, cell } = list[pass], columns = frame().passes[pass].tiles[0];
    return [x + (tile % columns + 0.5) * cell, y + (Math.floor(tile / columns) + 0.5) * cell];
  };
  if (state.at > 0 && state.at < 1) {
    // Misses of the tiles that ended within the last eighth of a step, over the content of the L2.
    if (isL2()) {
      ink.fillStyle = "#d55e00";
      ink.beginPath();
      for (let at = ended(run); at-- > 0 && run.ends[at] > now - run.end / data.steps / 8;) {
        const { pass, tile, of } = run.done[at], misses = of.l2_misses[tile];
        const [x, y] = centre(run.done[at]), radius = Math.min(6, Math.sqrt(misses * list[pass].cell / 20));
        if (misses) ink.moveTo(x + radius, y), ink.arc(x, y, radius, 0, 7);
      }
      ink.fill();
    }
    // The last tiles in the order of work, joined within each eye.
    let last = run.begun.length;
    for (let low = 0; low < last;) {
      const middle = low + last >> 1, { of, tile } = run.begun[middle];
      of.start[tile] <= now ? low = middle + 1 : last = middle;
    }
    const from = [];
    ink.beginPath();
    for (const step of run.begun.slice(Math.max(0, last - TRAIL), last)) {
      const to = centre(step);
      if (from[step.pass]) ink.moveTo(...from[step.pass]), ink.lineTo(...to);
      from[step.pass] = to;
    }
    for (const [colour, width] of [[inks.bg, 4], [inks.fg, 1.5]]) {
      [ink.strokeStyle, ink.lineWidth] = [colour, width];
      ink.stroke();
    }
    ink.lineWidth = 1;
  }
  if (state.cursor) {
    const [x, y] = centre(state.cursor), size = Math.max(6, list[state.cursor.pass].cell + 2);
    for (const [colour, width] of [[inks.bg, 5], [inks.fg, 2]]) {
      [ink.strokeStyle, ink.lineWidth] = [colour, width];
      ink.strokeRect(x - size / 2, y - size / 2, size, size);
    }
    ink.lineWidth = 1;
  }
};
