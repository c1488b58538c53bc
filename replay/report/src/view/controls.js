// What the controls, the pointer and the keys do.
const describe = () => {
  if (!state.cursor) return ($("tile").textContent = "");
  const { pass: at, tile } = state.cursor, pass = frame().passes[at], columns = pass.tiles[0];
  const place = `${pass.name}, column ${tile % columns}, row ${Math.floor(tile / columns)}`;
  if (data.metrics) {
    const own = run => metrics.map(([name, unit, of]) => `${digits(of(pass, run, tile))}${unit ? ` ${unit}` : ""} ${name}`).join(", ");
    const texts = pass.runs.map((run, number) => `${data.runs[number].title}: ${own(run)}`);
    return ($("tile").textContent = `${place}. ${texts.join("; ")}.`);
  }
  const inL2 = (run, number) => (IN_L2 < 0 ? "" : `, ${digits(share(run.in_l2[stepOf(frame().runs[number])][tile], data.full))} % of its lines in the L2 now`);
  const texts = pass.runs.map((run, number) => `${data.runs[number].title}: ${digits(run.l1_misses[tile])} L1 misses, ${digits(run.l2_misses[tile])} lines from memory, tile ${digits(run.rank[tile] + 1)} of the order on core ${run.core[tile]}${inL2(run, number)}`);
  const draws = [...pass.parts.draw].filter(([, quads]) => quads.has(tile)).sort((a, b) => b[1].get(tile) - a[1].get(tile));
  const names = draws.slice(0, 3).map(([draw]) => data.draws[draw]);
  const more = draws.length > names.length ? ` and ${draws.length - names.length} more` : "";
  $("tile").textContent = `${place}: ${digits(pass.footprints[tile])} footprints, ${digits(pass.overdraw_pct[tile])} % covered, ${digits(share(pass.shared_lines[tile], pass.lines[tile]))} % of ${digits(pass.lines[tile])} lines shared with the other eye${names.length ? `, ${names.join(", ")}${more}` : ""}. ${texts.join("; ")}.`;
};

let asked = 0, lastTick = 0, lastCount = 0;
const draw = now => {
  asked = 0;
  const began = performance.now();
  if (state.playing) {
    // The time of a picture can lie before the key or click that started it.
    state.at = Math.min(1, state.at + Math.max(0, now - lastTick) / (1000 * $("speed").value));
    if (state.at >= 1) play(false);
  }
  lastTick = now;
  canvases.forEach(drawRun);
  if (IN_L2 >= 0) charts.forEach(drawL2);
  if (!data.metrics) {
    drawCurve();
    // Nobody reads figures that change with every picture. Their layout and the slider take half of the time.
    if (!state.playing || now - lastCount > 500) {
      count();
      $("at").value = 1000 * state.at;
      lastCount = now;
    }
  }
  // The main thread's time, for measurements.
  root.dispatchEvent(new CustomEvent("drawn", { detail: performance.now() - began }));
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
  if (!is) describe();
  request();
}
const go = at => {
  state.at = Math.max(0, Math.min(1, at));
  $("at").value = 1000 * state.at;
  describe();
  request();
};
const choose = (pass, tile) => {
  state.cursor = { pass, tile };
  describe();
  request();
};
// Shows the tiles of a part, which is named as in the list of parts.
function pick(key, scroll) {
  const at = key.lastIndexOf(" ");
  state.part = key ? { kind: key.slice(0, at), index: +key.slice(at + 1) } : null;
  $("part").value = key;
  $("metric").disabled = !!state.part;
  showReads();
  updateMaps();
  if (scroll) root.scrollIntoView();
}

const option = (name, value) => Object.assign(make("option", name), { value });
metrics.forEach(([name], at) => $("metric").append(option(name, at)));
$("part").append(option("everything", ""));
for (const kind in data.metrics ? {} : KINDS) {
  const group = Object.assign(make("optgroup"), { label: KINDS[kind] });
  const part = data.parts.find(part => part.kind === kind);
  part.names.forEach((_, at) => part.footprints[at] && group.append(option(nameOf(kind, at), `${kind} ${at}`)));
  $("part").append(group);
}
if (!data.metrics) {
  data.parts.forEach(({ kind }, at) => $("kind").append(option(kind, at)));
  $("kind").onchange = () => showParts($("kind").value);
  $("kind").value = 1;
  showParts(1);
}
$("ramp").style.background = `linear-gradient(to right, ${[0, 64, 128, 192, 255].map(at => `#${data.ramp.slice(6 * at, 6 * at + 6)}`).join(", ")})`;
data.runs.forEach((run, number) => {
  const swatch = make("span", "\u25cf ");
  swatch.style.color = `#${run.color}`;
  $(`name-${number}`).prepend(swatch);
});
if (IN_L2 < 0) [...charts, ...root.querySelectorAll(".owners")].forEach(of => (of.hidden = true));
const showFrame = () => {
  if (!frame().isUnpacked) unpackFrame(frame());
  state.cursor = null;
  name();
  describe();
  updateMaps();
};
const name = () => {
  $("number").textContent = frame().number;
  $("curve-name").textContent = `Bytes from DRAM in frame ${frame().number}, by ${state.by === "time" ? "time" : "tiles rendered"}; the dots are at the place of the animation.`;
};
$("frame").max = data.frames.length - 1;
$("frames").hidden = data.frames.length < 2;

$("play").onclick = () => play(!state.playing);
$("at").oninput = () => go($("at").value / 1000);
$("by").onchange = () => ((state.by = $("by").value), name(), request());
$("metric").onchange = () => ((state.metric = +$("metric").value), updateMaps());
$("part").onchange = () => pick($("part").value);
$("frame").oninput = () => ((state.frame = +$("frame").value), showFrame());
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
addEventListener("resize", () => (showReads(), request()));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (readInks(), showReads(), request()));
readInks();
showFrame();
