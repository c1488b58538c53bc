// Charts over the frame: the content of the L2 of each order, bytes from DRAM, and the counts so far.
const charts = [...root.querySelectorAll("canvas.l2")], curve = $("curve");
const OWNERS = [...root.querySelectorAll(".owners i")].map(of => of.style.backgroundColor);

// What changes only with size, frame and colours is drawn once.
const kept = new Map();
const keep = (canvas, height, paint) => {
  const width = canvas.clientWidth, scale = devicePixelRatio || 1, key = [width, state.frame, state.by, inks.fg, scale].join();
  let found = kept.get(canvas);
  if (!found || found.key !== key) {
    found = { key, still: document.createElement("canvas") };
    paint(fit(found.still, height, width), width);
    kept.set(canvas, found);
  }
  const ink = fit(canvas, height);
  ink.drawImage(found.still, 0, 0, width, height);
  return ink;
};

// Areas from below: both eyes, left, right, neither.
const L2 = { height: 92, areas: 54, bars: 24, order: [2, 0, 1, 3] };
const drawAreas = (ink, l2, width) => {
  const x = step => width * (state.by === "time" ? l2.time[step] / frame().end : l2.work[step]);
  const below = new Float64Array(data.steps + 1), top = NAME + L2.areas;
  const y = lines => top - L2.areas * lines / data.l2_lines;
  ink.strokeStyle = inks.line;
  ink.strokeRect(0, NAME, width, L2.areas);
  for (const owner of L2.order) {
    ink.beginPath();
    for (let step = data.steps; step >= 0; step--) ink.lineTo(x(step), y(below[step]));
    for (let step = 0; step <= data.steps; step++) ink.lineTo(x(step), y(below[step] += l2.lines[owner][step]));
    ink.fillStyle = OWNERS[owner];
    ink.fill();
  }
  ink.fillStyle = inks.muted;
  for (let step = 1; step <= data.steps; step++) {
    const height = L2.bars * l2.entered[step] / frame().mostEntered;
    ink.fillRect(x(step - 1), L2.height - height, Math.max(0.5, x(step) - x(step - 1)), height);
  }
};
const drawL2 = (canvas, number) => {
  const run = frame().runs[number], l2 = frame().l2[number], width = canvas.clientWidth;
  const ink = keep(canvas, L2.height, (ink, width) => drawAreas(ink, l2, width)), step = stepOf(run);
  const at = width * (state.by === "time" ? Math.min(clock(run), run.end) / frame().end : state.at);
  ink.fillStyle = inks.fg;
  ink.fillRect(Math.min(width - 2, at), NAME, 2, L2.height - NAME);
  const lines = l2.lines.reduce((sum, of) => sum + of[step], 0);
  ink.fillText(`L2: ${digits(lines)} of ${digits(data.l2_lines)} lines, ${digits(share(l2.lines[2][step], lines))} % of both eyes`, 0, NAME - 5);
};

const CURVE = { height: 170, left: 62, right: 8, top: 8, bottom: 34 };
const drawCurve = () => {
  const width = curve.clientWidth - CURVE.left - CURVE.right, height = CURVE.height - CURVE.top - CURVE.bottom;
  const runs = frame().runs, total = Math.max(1, ...runs.map(run => run.l2[run.l2.length - 1]));
  const isTime = state.by === "time";
  const x = (run, count) => CURVE.left + width * (isTime ? (count ? run.ends[count - 1] / frame().end : 0) : count / run.ends.length);
  const y = lines => CURVE.top + height * (1 - lines / total);
  const ink = keep(curve, CURVE.height, ink => {
    ink.strokeStyle = inks.line;
    ink.strokeRect(CURVE.left, CURVE.top, width, height);
    ink.fillStyle = inks.muted;
    ink.textAlign = "right";
    ink.fillText(`${digits(total * data.line_bytes / 1e6, 2)} MB`, CURVE.left - 5, CURVE.top + 9);
    ink.fillText("0", CURVE.left - 5, CURVE.top + height);
    ink.fillText(isTime ? `${digits(frame().end)} cycles` : `${digits(runs[0].ends.length)} tiles`, CURVE.left + width, CURVE.height - 14);
    ink.textAlign = "left";
    ink.lineWidth = 2;
    runs.forEach((run, number) => {
      ink.beginPath();
      const step = Math.max(1, run.ends.length >> 9);
      for (let count = 0; count <= run.ends.length; count += step) ink.lineTo(x(run, count), y(run.l2[count]));
      ink.lineTo(x(run, run.ends.length), y(run.l2[run.ends.length]));
      ink.strokeStyle = `#${data.runs[number].color}`;
      ink.stroke();
    });
  });
  runs.forEach((run, number) => {
    const count = ended(run);
    ink.fillStyle = `#${data.runs[number].color}`;
    ink.beginPath();
    ink.arc(x(run, count), y(run.l2[count]), 4, 0, 7);
    ink.fill();
  });
};

const headRow = heads => make("thead", make("tr", ...heads.map((name, at) => Object.assign(make("th", name), { scope: "col", className: at ? "num" : "" }))));
const owners = IN_L2 < 0 ? [] : ["lines in the L2", "left eye only", "right eye only", "both eyes", "neither"];
const cells = data.runs.map(() => []);
{
  const heads = ["order", "tiles", "cycles", "L1 misses", "L2 misses", "MB from DRAM", ...owners];
  const body = make("tbody", ...data.runs.map((run, number) => {
    const row = make("tr", Object.assign(make("th", run.title), { scope: "row" }));
    for (let at = 1; at < heads.length; at++) cells[number].push(row.appendChild(Object.assign(make("td"), { className: "num" })));
    return row;
  }));
  $("counts").append(make("caption", "Up to the place of the animation"), headRow(heads), body);
}
const count = () => frame().runs.forEach((run, number) => {
  const done = ended(run), now = Math.max(0, Math.min(run.end, clock(run)));
  const shown = [done, now, run.l1[done], run.l2[done]].map(value => digits(value));
  shown.push(digits(run.l2[done] * data.line_bytes / 1e6, 3));
  if (owners.length) {
    const lines = frame().l2[number].lines.map(of => of[stepOf(run)]);
    shown.push(...[lines.reduce((a, b) => a + b), ...lines].map(value => digits(value)));
  }
  shown.forEach((text, at) => (cells[number][at].textContent = text));
});
