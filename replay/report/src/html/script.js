// Sorting, filtering and choice of columns of tables, and reading of charts by keyboard. The page is whole
// without it.
(() => {
  const make = (tag, set, ...inside) => {
    const made = Object.assign(document.createElement(tag), set);
    made.append(...inside);
    return made;
  };
  const number = text => {
    const value = text.replace(/[\u2009\u00a0 ]/g, "").replace("\u2212", "-");
    return value === "" || isNaN(value) ? null : +value;
  };
  const compare = (a, b) => {
    if (a === "" || b === "") return (a === "") - (b === "");
    const [x, y] = [number(a), number(b)];
    return x !== null && y !== null ? x - y : a.localeCompare(b, "en", { numeric: true });
  };
  for (const box of document.querySelectorAll(".table")) {
    const scroll = box.querySelector(".scroll"), table = box.querySelector("table"), body = table.tBodies[0];
    const heads = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
    const rows = [...body.rows], bar = make("div", { className: "bar" });
    const above = [...document.querySelectorAll("main h2, main h3")].filter(h => h.compareDocumentPosition(box) & Node.DOCUMENT_POSITION_FOLLOWING).pop();
    if (!table.caption && above) {
      const name = above.textContent, number = (above.tables = (above.tables || 0) + 1);
      scroll.setAttribute("aria-label", number > 1 ? `${name}, table ${number}` : name);
    }
    heads.forEach((head, column) => {
      if (!head.textContent.trim()) return;
      const button = make("button", { type: "button" }, ...head.childNodes);
      head.append(button);
      button.onclick = () => {
        const up = head.getAttribute("aria-sort") !== "ascending";
        heads.forEach(h => h.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", up ? "ascending" : "descending");
        const text = row => row.cells[column].textContent;
        const sorted = [...body.rows].sort((a, b) => {
          if (text(a) === "" || text(b) === "") return compare(text(a), text(b));
          return up ? compare(text(a), text(b)) : compare(text(b), text(a));
        });
        sorted.forEach(row => row.classList.remove("first"));
        body.append(...sorted);
      };
    });
    if (rows.length > 7) {
      const shown = make("output", {});
      const input = make("input", { type: "search", placeholder: "filter rows" });
      input.setAttribute("aria-label", "filter rows");
      input.oninput = () => {
        const words = input.value.toLowerCase().split(/\s+/);
        let count = 0;
        for (const row of rows) {
          row.hidden = !words.every(word => row.textContent.toLowerCase().includes(word));
          count += !row.hidden;
        }
        shown.textContent = input.value ? `${count} of ${rows.length} rows` : "";
      };
      bar.append(input, shown);
    }
    const place = () => {
      // Leading columns of names stay, if they leave room for others.
      const keys = heads.findIndex(head => head.classList.contains("num"));
      let left = 0;
      for (let column = 1; column < keys; column++) {
        left += heads[column - 1].offsetWidth;
        const fits = left + heads[column].offsetWidth < 0.45 * scroll.clientWidth;
        for (const cell of [heads[column], ...rows.map(row => row.cells[column])]) {
          cell.classList.toggle("key", fits);
          cell.style.left = fits ? `${left}px` : "";
        }
      }
      const second = table.tHead.rows.length > 1 ? table.tHead.rows[0].offsetHeight : 0;
      heads.forEach(head => (head.style.top = `${second}px`));
      hint.hidden = scroll.scrollWidth <= scroll.clientWidth + 1;
    };
    if (heads.length > 7) {
      const list = make("div", { className: "columns" });
      heads.slice(1).forEach((head, index) => {
        const tick = make("input", { type: "checkbox", checked: true });
        tick.onchange = () => {
          for (const cell of [head, ...rows.map(row => row.cells[index + 1])]) cell.hidden = !tick.checked;
          for (const group of table.tHead.querySelectorAll("[data-from]")) {
            const own = heads.slice(+group.dataset.from, +group.dataset.to).filter(h => !h.hidden).length;
            group.hidden = own === 0;
            group.colSpan = Math.max(own, 1);
          }
          place();
        };
        const small = head.querySelector("small");
        const name = head.textContent.slice(0, head.textContent.length - (small ? small.textContent.length : 0)).trim();
        const group = [...table.tHead.querySelectorAll("[data-from]")].find(g => index + 1 >= +g.dataset.from && index + 1 < +g.dataset.to);
        list.append(make("label", {}, tick, ` ${group && group.textContent ? group.textContent + ": " : ""}${name}${small ? ", " + small.textContent : ""}`));
      });
      bar.append(make("details", {}, make("summary", {}, "columns"), list));
    }
    const hint = make("span", { className: "hint" }, "more columns on the right \u2192");
    bar.append(hint);
    box.prepend(bar);
    place();
    addEventListener("resize", place);
    box.closest("details")?.addEventListener("toggle", place);
  }
  for (const svg of document.querySelectorAll("svg")) {
    const parts = [...svg.querySelectorAll("title")].map(title => title.parentNode);
    if (!parts.length) {
      // Without marks to go through, the keyboard scrolls the chart's box.
      svg.closest(".scroll")?.setAttribute("tabindex", "0");
      continue;
    }
    const says = make("output", { className: "exact" });
    svg.after(says);
    let at = -1;
    const show = part => {
      parts.forEach(p => p.classList.toggle("chosen", p === part));
      says.textContent = part ? part.querySelector("title").textContent : "";
      if (part) at = parts.indexOf(part);
    };
    svg.tabIndex = 0;
    svg.addEventListener("keydown", event => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      show(parts[(at + step + parts.length) % parts.length]);
    });
    svg.addEventListener("pointerover", event => show(event.target.querySelector?.(":scope > title") ? event.target : null));
    svg.addEventListener("blur", () => show(null));
  }
  addEventListener("beforeprint", () => document.querySelectorAll("main details").forEach(d => (d.open = true)));
})();
