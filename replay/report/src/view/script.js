// Maps of tiles, and orders as they run. Pictures of one pixel per tile are scaled up, so that a picture of a whole
// frame costs a few milliseconds.
(() => {
  const data = JSON.parse(document.getElementById("view-data").textContent);
  const root = document.getElementById("view"), $ = name => document.getElementById(`view-${name}`);
  const canvases = [...root.querySelectorAll(".orders canvas")], curve = $("curve");
  const make = (tag, ...inside) => {
    const made = document.createElement(tag);
    made.append(...inside);
    return made;
  };
  const digits = (value, decimals = 0) => value.toLocaleString("en", { minimumFractionDigits: decimals, maximumFractionDigits: decimals });
  const rgb = hex => [0, 2, 4].map(at => parseInt(hex.slice(at, at + 2), 16));
  const word = ([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
  const ramp = Uint32Array.from({ length: 256 }, (_, at) => word(rgb(data.ramp.slice(6 * at, 6 * at + 6))));
  const NOW = word([0xd5, 0x5e, 0x00]), TRAIL = 24;

  // Values of a tile by metric: of the pass, of a run's part of it, and of the whole frame.
  const share = (part, all) => (all ? 100 * part / all : 0);
  const metrics = data.metrics ? data.metrics.map(([key, name, unit]) => [name, unit, (p, r, t) => (r[key] || p[key])[t]]) : [
    ["L2 misses", "lines", (p, r, t) => r.l2_misses[t]],
    ["bytes from DRAM", "bytes", (p, r, t) => r.l2_misses[t] * data.line_bytes],
    ["L1 misses", "footprints", (p, r, t) => r.l1_misses[t]],
    ["footprints", "", (p, r, t) => p.footprints[t]],
    ["covered pixels", "%", (p, r, t) => p.overdraw_pct[t]],
    ["shared with the other eye", "% of the tile's lines", (p, r, t) => share(p.shared_lines[t], p.lines[t])],
    ["order of work", "tiles before it", (p, r, t) => r.rank[t]],
  ];
  const state = { frame: 0, metric: 0, part: null, at: 1, by: "time", playing: 0, cursor: null };

  // The tiles of each run by the time at which they end, with sums of misses up to each of them.
  for (const frame of data.frames) {
    for (const pass of frame.passes) {
      // Maps without time have no counts to sum.
      const none = new Uint32Array(pass.tiles[0] * pass.tiles[1]);
      pass.footprints ||= none;
      if (data.metrics) for (const run of pass.runs) Object.assign(run, { start: none, end: none, l1_misses: none, l2_misses: none });
    }
    frame.runs = data.runs.map((_, run) => {
      const tiles = frame.passes.flatMap((pass, at) => Array.from(pass.footprints, (_, tile) => ({ pass: at, tile, of: pass.runs[run] })));
      const begun = [...tiles].sort((a, b) => a.of.start[a.tile] - b.of.start[b.tile]);
      for (const pass of frame.passes) pass.runs[run].rank = new Uint32Array(pass.footprints.length);
      begun.forEach(({ of, tile }, rank) => (of.rank[tile] = rank));
      tiles.sort((a, b) => a.of.end[a.tile] - b.of.end[b.tile]);
      const ends = tiles.map(({ of, tile }) => of.end[tile]);
      const sums = key => {
        const out = [0];
        for (const { of, tile } of tiles) out.push(out[out.length - 1] + of[key][tile]);
        return out;
      };
      return { begun, ends, l1: sums("l1_misses"), l2: sums("l2_misses"), end: ends[ends.length - 1] || 0 };
    });
    frame.end = Math.max(1, ...frame.runs.map(run => run.end));
    for (const pass of frame.passes) {
      pass.byDraw = new Map(pass.draws.map(([draw, list]) => {
        const quads = new Map();
        for (let at = 0, tile = 0; at < list.length; at += 2) quads.set((tile += list[at]), list[at + 1]);
        return [draw, quads];
      }));
      pass.image = new ImageData(...pass.tiles);
      pass.words = new Uint32Array(pass.image.data.buffer);
      pass.small = Object.assign(document.createElement("canvas"), { width: pass.tiles[0], height: pass.tiles[1] });
    }
  }
  const frame = () => data.frames[state.frame];

  // Values of all tiles of the frame, and the end of the colour scale, which all orders share.
  let values, most;
  const update = () => {
    const [, , of] = metrics[state.metric];
    values = frame().passes.map(pass => pass.runs.map(run => {
      const out = new Float64Array(pass.footprints.length);
      if (state.part) {
        for (const draw of state.part.draws) for (const [tile, quads] of pass.byDraw.get(draw) || []) out[tile] += quads;
      } else for (let tile = 0; tile < out.length; tile++) out[tile] = of(pass, run, tile);
      return out;
    }));
    most = values.flat().reduce((most, list) => list.reduce((a, b) => Math.max(a, b), most), 0) || 1;
    const unit = state.part ? "quads" : metrics[state.metric][1];
    $("most").textContent = `${digits(most)} ${unit} in a tile`;
    request();
  };

  // How many tiles of a run have ended.
  const ended = run => {
    if (state.by === "work") return Math.round(state.at * run.ends.length);
    const now = state.at * frame().end;
    let low = 0, high = run.ends.length;
    while (low < high) {
      const middle = low + high >> 1;
      run.ends[middle] <= now ? low = middle + 1 : high = middle;
    }
    return low;
  };
  const clock = run => {
    if (state.by === "time") return state.at * frame().end;
    const count = ended(run);
    return count ? run.ends[count - 1] : -1;
  };

  let inks = {};
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
  const fit = (canvas, height) => {
    const scale = devicePixelRatio || 1, width = canvas.clientWidth;
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
  const drawRun = (canvas, number) => {
    const { list, height } = places(canvas.clientWidth);
    const ink = fit(canvas, height), run = frame().runs[number], now = clock(run);
    ink.imageSmoothingEnabled = false;
    frame().passes.forEach((pass, at) => {
      const { x, y, w, h, cell } = list[at], { start, end } = pass.runs[number], shown = values[at][number];
      for (let tile = 0; tile < shown.length; tile++) {
        pass.words[tile] = start[tile] > now ? inks.waits
          : end[tile] > now ? NOW : ramp[Math.min(255, 255 * shown[tile] / most | 0)];
      }
      pass.small.getContext("2d").putImageData(pass.image, 0, 0);
      const isShown = picture && picture.complete && pass.eye !== null;
      if (isShown) {
        const half = picture.naturalWidth / 2;
        ink.drawImage(picture, pass.eye * half, 0, half, picture.naturalHeight, x, y, w, h);
      }
      ink.globalAlpha = isShown ? 0.72 : 1;
      ink.drawImage(pass.small, x, y, w, h);
      ink.globalAlpha = 1;
      ink.strokeStyle = inks.line;
      ink.strokeRect(x, y, w, h);
      if (cell >= 7) {
        ink.beginPath();
        for (let column = 1; column < pass.tiles[0]; column++) ink.rect(x + column * cell, y, 0, h);
        for (let row = 1; row < pass.tiles[1]; row++) ink.rect(x, y + row * cell, w, 0);
        ink.globalAlpha = 0.25;
        ink.stroke();
        ink.globalAlpha = 1;
      }
      ink.fillStyle = inks.fg;
      ink.fillText(pass.name, x, y - 5);
    });
    const centre = ({ pass, tile }) => {
      const { x, y, cell } = list[pass], columns = frame().passes[pass].tiles[0];
      return [x + (tile % columns + 0.5) * cell, y + (Math.floor(tile / columns) + 0.5) * cell];
    };
    if (state.at > 0 && state.at < 1) {
      // The last tiles in the order of work, joined within each eye.
      let last = run.begun.length;
      for (let low = 0; low < last;) {
        const middle = low + last >> 1, { of, tile } = run.begun[middle];
        of.start[tile] <= now ? low = middle + 1 : last = middle;
      }
      const before = [];
      ink.beginPath();
      for (const step of run.begun.slice(Math.max(0, last - TRAIL), last)) {
        const to = centre(step), from = before[step.pass];
        if (from) ink.moveTo(...from), ink.lineTo(...to);
        before[step.pass] = to;
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

  const CURVE = { height: 170, left: 62, right: 8, top: 8, bottom: 34 };
  const drawCurve = () => {
    const ink = fit(curve, CURVE.height), width = curve.clientWidth - CURVE.left - CURVE.right, height = CURVE.height - CURVE.top - CURVE.bottom;
    const runs = frame().runs, total = Math.max(1, ...runs.map(run => run.l2[run.l2.length - 1]));
    const isTime = state.by === "time";
    const x = (run, count) => CURVE.left + width * (isTime ? (count ? run.ends[count - 1] / frame().end : 0) : count / run.ends.length);
    const y = lines => CURVE.top + height * (1 - lines / total);
    ink.strokeStyle = inks.line;
    ink.strokeRect(CURVE.left, CURVE.top, width, height);
    ink.fillStyle = inks.muted;
    ink.textAlign = "right";
    ink.fillText(`${digits(total * data.line_bytes / 1e6, 2)} MB`, CURVE.left - 5, CURVE.top + 9);
    ink.fillText("0", CURVE.left - 5, CURVE.top + height);
    ink.fillText(isTime ? `${digits(frame().end)} cycles` : `${digits(runs[0].ends.length)} tiles`, CURVE.left + width, CURVE.height - 14);
    ink.textAlign = "left";
    runs.forEach((run, number) => {
      ink.beginPath();
      const step = Math.max(1, run.ends.length >> 9);
      for (let count = 0; count <= run.ends.length; count += step) ink.lineTo(x(run, count), y(run.l2[count]));
      ink.lineTo(x(run, run.ends.length), y(run.l2[run.ends.length]));
      ink.strokeStyle = `#${data.runs[number].color}`;
      ink.lineWidth = 2;
      ink.stroke();
      ink.fillStyle = ink.strokeStyle;
      const count = ended(run);
      ink.beginPath();
      ink.arc(x(run, count), y(run.l2[count]), 4, 0, 7);
      ink.fill();
    });
    ink.lineWidth = 1;
  };

  const table = $("counts");
  const cells = data.runs.map(() => []);
  {
    const heads = ["order", "tiles", "cycles", "L1 misses", "L2 misses", "MB from DRAM"];
    table.append(make("caption", "Up to the place of the animation"), make("thead", make("tr", ...heads.map((name, at) => Object.assign(make("th", name), { scope: "col", className: at ? "num" : "" })))));
    const body = make("tbody");
    data.runs.forEach((run, number) => {
      const row = make("tr", Object.assign(make("th", run.title), { scope: "row" }));
      for (let at = 1; at < heads.length; at++) {
        const cell = Object.assign(make("td"), { className: "num" });
        cells[number].push(cell);
        row.append(cell);
      }
      body.append(row);
    });
    table.append(body);
  }
  const count = () => frame().runs.forEach((run, number) => {
    const done = ended(run), now = Math.max(0, Math.min(run.end, clock(run)));
    const shown = [done, now, run.l1[done], run.l2[done]].map(value => digits(value));
    shown.push(digits(run.l2[done] * data.line_bytes / 1e6, 3));
    shown.forEach((text, at) => (cells[number][at].textContent = text));
  });

  const describe = () => {
    if (!state.cursor) return ($("tile").textContent = "");
    const { pass: at, tile } = state.cursor, pass = frame().passes[at], columns = pass.tiles[0];
    if (data.metrics) {
      const own = run => metrics.map(([name, unit, of]) => `${digits(of(pass, run, tile))}${unit ? ` ${unit}` : ""} ${name}`).join(", ");
      const texts = pass.runs.map((run, number) => `${data.runs[number].title}: ${own(run)}`);
      return ($("tile").textContent = `${pass.name}, column ${tile % columns}, row ${Math.floor(tile / columns)}. ${texts.join("; ")}.`);
    }
    const counts = pass.runs.map((run, number) => `${data.runs[number].title}: ${digits(run.l1_misses[tile])} L1 misses, ${digits(run.l2_misses[tile])} lines from memory, tile ${digits(run.rank[tile] + 1)} of the order on core ${run.core[tile]}`);
    const draws = [...pass.byDraw].filter(([, quads]) => quads.has(tile)).sort((a, b) => b[1].get(tile) - a[1].get(tile));
    const names = draws.slice(0, 3).map(([draw]) => data.draws[draw]);
    const more = draws.length > names.length ? ` and ${draws.length - names.length} more` : "";
    $("tile").textContent = `${pass.name}, column ${tile % columns}, row ${Math.floor(tile / columns)}: ${digits(pass.footprints[tile])} footprints, ${digits(pass.overdraw_pct[tile])} % covered, ${digits(share(pass.shared_lines[tile], pass.lines[tile]))} % of ${digits(pass.lines[tile])} lines shared with the other eye${names.length ? `, ${names.join(", ")}${more}` : ""}. ${counts.join("; ")}.`;
  };

  let asked = 0, lastTick = 0;
  const draw = now => {
    asked = 0;
    const began = performance.now();
    if (state.playing) {
      // The time of a picture can lie before the key or click that started it.
      state.at = Math.min(1, state.at + Math.max(0, now - lastTick) / (1000 * $("speed").value));
      $("at").value = 1000 * state.at;
      if (state.at >= 1) play(false);
    }
    lastTick = now;
    canvases.forEach(drawRun);
    drawCurve();
    count();
    root.dataset.ms = (performance.now() - began).toFixed(2);
    if (state.playing) request();
  };
  function request() {
    asked ||= requestAnimationFrame(draw);
  }
  function play(is) {
    if (is && state.at >= 1) state.at = 0;
    state.playing = is;
    lastTick = performance.now();
    $("play").textContent = is ? "Pause" : "Play";
    request();
  }
  const go = at => {
    state.at = Math.max(0, Math.min(1, at));
    $("at").value = 1000 * state.at;
    request();
  };
  const choose = (pass, tile) => {
    state.cursor = { pass, tile };
    describe();
    request();
  };

  metrics.forEach(([name], at) => $("metric").append(Object.assign(make("option", name), { value: at })));
  const part = $("part");
  const group = (label, list) => {
    const made = Object.assign(make("optgroup"), { label });
    list.forEach(({ name, draws, key }) => draws.length && made.append(Object.assign(make("option", name), { value: key })));
    part.append(made);
  };
  const parts = new Map();
  const keyed = (kind, list) => list.map((item, at) => {
    parts.set(`${kind} ${at}`, item);
    return { ...item, key: `${kind} ${at}` };
  });
  part.append(Object.assign(make("option", "everything"), { value: "" }));
  group("draws", keyed("draw", data.draws.map((name, at) => ({ name: `draw ${at}: ${name}`, draws: [at] }))));
  group("textures", keyed("texture", data.textures));
  $("ramp").style.background = `linear-gradient(to right, ${[0, 64, 128, 192, 255].map(at => `#${data.ramp.slice(6 * at, 6 * at + 6)}`).join(", ")})`;
  data.runs.forEach((run, number) => {
    const swatch = make("span", "\u25cf ");
    swatch.style.color = `#${run.color}`;
    $(`name-${number}`).prepend(swatch);
  });
  const name = () => {
    $("number").textContent = frame().number;
    $("curve-name").textContent = `Bytes from DRAM in frame ${frame().number}, by ${state.by === "time" ? "time" : "tiles rendered"}; the dots are at the place of the animation.`;
  };
  $("frame").max = data.frames.length - 1;
  $("frames").hidden = data.frames.length < 2;

  $("play").onclick = () => play(!state.playing);
  $("at").oninput = () => go($("at").value / 1000);
  $("by").onchange = () => ((state.by = $("by").value), name(), request());
  $("metric").onchange = () => ((state.metric = +$("metric").value), update());
  part.onchange = () => {
    state.part = parts.get(part.value) || null;
    $("metric").disabled = !!state.part;
    update();
  };
  $("frame").oninput = () => {
    state.frame = +$("frame").value;
    state.cursor = null;
    name();
    describe();
    update();
  };
  canvases.forEach((canvas, number) => {
    canvas.onpointerdown = event => {
      const box = canvas.getBoundingClientRect(), [px, py] = [event.clientX - box.left, event.clientY - box.top];
      places(canvas.clientWidth).list.forEach(({ x, y, cell }, pass) => {
        const [column, row] = [Math.floor((px - x) / cell), Math.floor((py - y) / cell)];
        const [columns, rows] = frame().passes[pass].tiles;
        if (column >= 0 && row >= 0 && column < columns && row < rows) choose(pass, row * columns + column);
      });
    };
    canvas.onkeydown = event => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const run = frame().runs[number], move = { ",": -1, ".": 1 }[event.key];
      if (step) {
        const { pass, tile } = state.cursor || { pass: 0, tile: 0 }, [columns, rows] = frame().passes[pass].tiles;
        let [column, row, to] = [tile % columns + step[0], Math.floor(tile / columns) + step[1], pass];
        // Beyond the edge lies the next pass.
        if ((column < 0 || column >= columns) && frame().passes[pass + step[0]]) {
          to = pass + step[0];
          column = step[0] > 0 ? 0 : frame().passes[to].tiles[0] - 1;
        }
        const [wide, high] = frame().passes[to].tiles, clamp = (value, end) => Math.max(0, Math.min(end - 1, value));
        choose(to, clamp(row, high) * wide + clamp(column, wide));
      } else if (event.key === " ") play(!state.playing);
      else if (move) {
        const to = Math.max(0, Math.min(run.ends.length, ended(run) + move));
        go(state.by === "work" ? to / run.ends.length : (to ? run.ends[to - 1] : 0) / frame().end);
      } else if (event.key === "Home") go(0);
      else if (event.key === "End") go(1);
      else return;
      event.preventDefault();
    };
  });
  addEventListener("resize", request);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (readInks(), request()));
  readInks();
  name();
  update();
})();
