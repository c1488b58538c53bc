// The data of the page as lists of numbers, the state of its controls, and small tools.
const data = JSON.parse(document.getElementById("view-data").textContent);
const root = document.getElementById("view"), $ = name => document.getElementById(`view-${name}`);
const make = (tag, ...inside) => {
  const made = document.createElement(tag);
  made.append(...inside);
  return made;
};
const digits = (value, decimals = 0) => value.toLocaleString("en", { minimumFractionDigits: decimals, maximumFractionDigits: decimals });
const rgb = hex => [0, 2, 4].map(at => parseInt(hex.slice(at, at + 2), 16));
const word = ([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
const share = (part, all) => (all ? 100 * part / all : 0);

// The reverse of `pack.rs`: digits of five bits, the lowest first; 32 says that another one follows.
const VALUES = Uint8Array.from({ length: 128 }, (_, code) => Math.max(0, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_".indexOf(String.fromCharCode(code))));
const unpack = list => {
  if (typeof list !== "string") return list;
  const out = new Uint32Array(list.length);
  let size = 0, value = 0, place = 1;
  for (let at = 0; at < list.length; at++) {
    const digit = VALUES[list.charCodeAt(at)];
    value += (digit & 31) * place;
    if (digit > 31) place *= 32;
    else (out[size++] = value), (value = 0), (place = 1);
  }
  return out.slice(0, size);
};

// Values of a tile by metric: of the pass and of a run's part of it.
const metrics = data.metrics ? data.metrics.map(([key, name, unit]) => [name, unit, (p, r, t) => (r[key] || p[key])[t]]) : [
  ["L2 misses", "lines", (p, r, t) => r.l2_misses[t]],
  ["bytes from DRAM", "bytes", (p, r, t) => r.l2_misses[t] * data.line_bytes],
  ["L1 misses", "footprints", (p, r, t) => r.l1_misses[t]],
  ["footprints", "", (p, r, t) => p.footprints[t]],
  ["covered pixels", "%", (p, r, t) => p.overdraw_pct[t]],
  ["shared with the other eye", "% of the tile's lines", (p, r, t) => share(p.shared_lines[t], p.lines[t])],
  ["order of work", "tiles before it", (p, r, t) => r.rank[t]],
];
// The last metric changes with time, if the content of the L2 was recorded.
const IN_L2 = !data.metrics && data.frames.every(frame => frame.l2.every(of => of)) ? metrics.push(["in the L2 now", "% of the tile's lines"]) - 1 : -1;
const state = { frame: 0, metric: 0, part: null, at: 1, by: "time", playing: 0, cursor: null };
const frame = () => data.frames[state.frame];
const isL2 = () => state.metric === IN_L2 && !state.part;

const KINDS = { draw: "draws", texture: "textures", "mip level": "levels" };
const counts = list => {
  const out = new Map();
  for (let at = 0, tile = 0; at < list.length; at += 2) out.set((tile += list[at]), list[at + 1]);
  return out;
};

// Shares of the tiles in the L2, packed as `pack.rs` says: a list for each step.
const sharesBySteps = (list, tiles) => {
  const out = Array.from({ length: data.steps + 1 }, () => new Uint8Array(tiles));
  for (let tile = 0, at = 0; tile < tiles; tile++) {
    let now = 0;
    for (let step = 0; step <= data.steps;) {
      const code = VALUES[list.charCodeAt(at++)], place = code >> 3;
      let end = Math.min(data.steps + 1, step + (now === (code & 7) ? 8 * (place + 1) : place));
      for (; step < end; step++) out[step][tile] = now;
      if (now !== (code & 7)) out[step++][tile] = now = code & 7;
    }
  }
  return out;
};

// A frame's lists are unpacked when it is shown first: the tiles of each run by the time at which they end, with sums of
// misses up to each of them.
const unpackFrame = frame => {
  for (const pass of frame.passes) {
    for (const key in pass) if (typeof pass[key] === "string" && key !== "name") pass[key] = unpack(pass[key]);
    // Maps without time have no counts to sum.
    const tiles = pass.tiles[0] * pass.tiles[1], none = new Uint32Array(tiles);
    pass.footprints ||= none;
    for (const run of pass.runs) {
      for (const key in run) if (key !== "in_l2") run[key] = unpack(run[key]);
      if (data.metrics) Object.assign(run, { start: none, cycles: none, l1_misses: none, l2_misses: none });
      run.end = run.start.map((start, tile) => start + run.cycles[tile]);
      run.rank = new Uint32Array(tiles);
      if (IN_L2 >= 0) run.in_l2 = sharesBySteps(run.in_l2, tiles);
    }
    pass.parts = {};
    for (const kind in KINDS) pass.parts[kind] = new Map((pass[KINDS[kind]] || []).map(([part, list]) => [part, counts(unpack(list))]));
    pass.image = new ImageData(...pass.tiles);
    pass.words = new Uint32Array(pass.image.data.buffer);
    pass.small = Object.assign(document.createElement("canvas"), { width: pass.tiles[0], height: pass.tiles[1] });
  }
  frame.runs = data.runs.map((_, run) => {
    const tiles = frame.passes.flatMap((pass, at) => Array.from(pass.footprints, (_, tile) => ({ pass: at, tile, of: pass.runs[run] })));
    const begun = [...tiles].sort((a, b) => a.of.start[a.tile] - b.of.start[b.tile]);
    begun.forEach(({ of, tile }, rank) => (of.rank[tile] = rank));
    tiles.sort((a, b) => a.of.end[a.tile] - b.of.end[b.tile]);
    const ends = tiles.map(({ of, tile }) => of.end[tile]);
    const sums = key => {
      const out = new Float64Array(tiles.length + 1);
      tiles.forEach(({ of, tile }, at) => (out[at + 1] = out[at] + of[key][tile]));
      return out;
    };
    return { begun, done: tiles, ends, l1: sums("l1_misses"), l2: sums("l2_misses"), end: ends[ends.length - 1] || 0 };
  });
  frame.end = Math.max(1, ...frame.runs.map(run => run.end));
  if (IN_L2 >= 0) {
    frame.l2.forEach((l2, run) => {
      Object.assign(l2, { lines: l2.lines.map(unpack), entered: unpack(l2.entered) });
      const { ends, end } = frame.runs[run];
      l2.time = Array.from({ length: data.steps + 1 }, (_, step) => end * step / data.steps);
      l2.work = l2.time.map(now => before(ends, now) / ends.length);
    });
    frame.mostEntered = Math.max(1, ...frame.l2.flatMap(l2 => [...l2.entered]));
  }
  frame.isUnpacked = true;
};

// How many of the ascending values are not above `most`.
function before(values, most) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = low + high >> 1;
    values[middle] <= most ? low = middle + 1 : high = middle;
  }
  return low;
}

// How many tiles of a run have ended, its cycle, and the step of the L2's content.
const ended = run => (state.by === "work" ? Math.round(state.at * run.ends.length) : before(run.ends, state.at * frame().end));
const clock = run => {
  if (state.by === "time") return state.at * frame().end;
  const count = ended(run);
  return count ? run.ends[count - 1] : -1;
};
const stepOf = run => Math.max(0, Math.min(data.steps, Math.floor(data.steps * clock(run) / (run.end || 1))));
