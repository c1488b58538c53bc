// Counts by eye, mip level, texture and draw, and the texels that a texture or draw reads.
const nameOf = (kind, index) => (kind === "draw" ? `draw ${index}: ${data.draws[index]}` : kind === "texture" ? data.textures[index] : `level ${index}`);
const reads = () => (state.part && data.reads && data.reads[state.part.kind] || [])[state.part && state.part.index] || [];

// Rectangles of a texture's levels, the finest first; levels without a read have an outline only.
const MAP = { width: 192, least: 4, gap: 6 };
const drawTexture = (canvas, maps) => {
  const [w, h] = maps[0][2].map(size => size * 2 ** maps[0][1]);
  const deepest = Math.max(...maps.map(([, level]) => level)), scale = Math.min(MAP.width / w, MAP.width / h);
  const ink = fit(canvas, Math.ceil(h * scale) + 2);
  for (let level = 0, x = 1; level <= deepest; level++) {
    const [wide, high] = [w, h].map(size => Math.max(MAP.least, size * scale / 2 ** level));
    const map = maps.find(map => map[1] === level);
    if (map) {
      const [columns, rows] = map[5], runs = unpack(map[6]), image = new ImageData(columns, rows), words = new Uint32Array(image.data.buffer);
      for (let at = 0, cell = 0; at < runs.length; at += 2) words.fill(runs[at] ? ramp[255 * runs[at] / data.full | 0] : inks.waits, cell, cell += runs[at + 1]);
      const small = Object.assign(document.createElement("canvas"), { width: columns, height: rows });
      small.getContext("2d").putImageData(image, 0, 0);
      ink.imageSmoothingEnabled = false;
      ink.drawImage(small, x, 1, wide, high);
    }
    ink.strokeStyle = inks.muted;
    ink.strokeRect(x, 1, wide, high);
    x += wide + MAP.gap;
  }
};
const showReads = () => {
  const all = reads(), textures = [...new Set(all.map(([texture]) => texture))];
  $("reads").hidden = !state.part;
  $("reads-name").textContent = state.part ? `${nameOf(state.part.kind, state.part.index)} ${textures.length ? `reads the bright texels of ${textures.length === 1 ? "this texture" : `these ${textures.length} textures`}, level 0 on the left:` : "is shown on the maps."}` : "";
  const figures = textures.map(texture => {
    const maps = all.filter(map => map[0] === texture), canvas = make("canvas");
    const levels = maps.map(([, level, , , [read, blocks]]) => `${level}: ${digits(share(read, blocks), 1)} %`);
    const text = `${data.textures[texture]}, ${maps[0][2].map(size => size * 2 ** maps[0][1]).join("x")} texels; read of level ${levels.join(", ")}`;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Texels read, ${text}`);
    return [make("figure", canvas, make("figcaption", text)), canvas, maps];
  });
  $("reads").querySelector(".textures").replaceChildren(...figures.map(([figure]) => figure));
  figures.forEach(([, canvas, maps]) => drawTexture(canvas, maps));
};

// Bars behind figures, as long as their share of the largest in the column.
const showParts = kind => {
  const part = data.parts[kind], canPick = part.kind in KINDS, several = data.runs.length > 1;
  const columns = [["footprints", part.footprints]];
  for (const [name, key, scale] of [["L1 misses", "l1_misses", 1], ["L2 misses", "l2_misses", 1], ["MB from DRAM", "l2_misses", data.line_bytes / 1e6]])
    part.runs.forEach((run, number) => columns.push([several ? `${name}, ${data.runs[number].title}` : name, run[key].map(value => value * scale), scale < 1 ? 3 : 0]));
  columns.push(["lines", part.lines], ["shared by both eyes, %", part.lines.map((lines, at) => share(part.shared_lines[at], lines)), 1]);
  const tops = columns.map(([, list]) => Math.max(...list) || 1), misses = part.runs[0].l2_misses;
  const rows = part.names.map((_, at) => at).filter(at => part.footprints[at]);
  if (part.kind === "texture" || part.kind === "draw") rows.sort((a, b) => misses[b] - misses[a]);
  const body = make("tbody", ...rows.map(at => {
    const head = Object.assign(make("th"), { scope: "row" });
    const name = part.kind === "draw" ? nameOf("draw", at) : part.names[at];
    head.append(canPick ? Object.assign(make("button", name), { type: "button", onclick: () => pick(`${part.kind} ${at}`, true) }) : name);
    return make("tr", head, ...columns.map(([, list, decimals], column) => {
      const cell = Object.assign(make("td", digits(list[at], decimals)), { className: "num" });
      cell.style.setProperty("--share", `${100 * list[at] / tops[column]}%`);
      return cell;
    }));
  }));
  const about = `By ${part.kind}, all frames. ${canPick ? "A name shows its tiles on the maps. " : ""}Bars: share of the column's largest.`;
  $("parts").replaceChildren(make("caption", about), headRow([part.kind, ...columns.map(([name]) => name)]), body);
};
