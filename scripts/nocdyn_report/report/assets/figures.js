"use strict";
// What a reader does with a figure: values under the pointer or by the arrow keys, zoom, the legend; and paper.
const report = (() => {
  const GROUPS = { order: "orders", mode: "modes" };

  // Of an envelope both ends.
  const valueText = (curve, i) => (curve.low ? `${numberText(curve.low[i])} to ` : "") + numberText(curve.y[i]);

  class Chart extends Picture {
    constructor(panel, spec, index) {
      super(panel, spec, index);
      this.status = panel.querySelector(".values");
      this.tip = document.createElement("div");
      this.tip.className = "tip";
      this.tip.hidden = true;
      this.at = null;
      this.listen();
      this.draw();
    }

    draw() {
      super.draw();
      this.cursor = this.svg.append("g").attr("class", "cursor");
      this.addBrush();
      this.picture.append(this.tip);
      if (this.at) this.show(this.at);
    }

    addBrush() {
      const { left, right, top, bottom } = this.box;
      const brush = d3.brush().extent([[left, top], [right, bottom]]).touchable(false).on("end", () => {
        const area = d3.event.selection;
        if (!area) return;
        const [[a, c], [b, d]] = area;
        if (b - a < 8) return this.draw();
        this.window.x = [this.x.invert(a), this.x.invert(b)];
        this.window.y = d - c < 12 || d - c > 0.8 * (bottom - top) ? this.window.y : [this.y.invert(d), this.y.invert(c)];
        this.draw();
      });
      this.svg.append("g").attr("class", "brush").call(brush);
    }

    listen() {
      this.picture.addEventListener("pointermove", (event) => this.point(event));
      this.picture.addEventListener("pointerdown", (event) => this.point(event));
      this.picture.addEventListener("pointerleave", () => this.hide());
      this.picture.addEventListener("blur", () => this.hide());
      this.picture.addEventListener("dblclick", () => this.zoom("all"));
      this.picture.addEventListener("keydown", (event) => this.key(event));
      this.figure.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => this.zoom(button.dataset.zoom)));
    }

    point(event) {
      const frame = this.svg.node().getBoundingClientRect(), scale = this.width() / (frame.width || 1);
      const px = (event.clientX - frame.left) * scale, py = (event.clientY - frame.top) * scale;
      const { left, right, top, bottom } = this.box;
      if (px < left || px > right || py < top || py > bottom) return this.hide();
      const found = this.nearest(px, this.spec.nearest ? py : null);
      if (found) this.show(found);
    }

    // The sample next to a place; with a y, of the curve that is nearest there.
    nearest(px, py = null) {
      let best = null;
      for (const curve of this.shown()) {
        const i = this.index(curve, this.x.invert(px));
        if (i < 0) continue;
        const dx = this.x(curve.x[i]) - px, dy = py === null ? 0 : this.y(curve.y[i]) - py;
        const distance = (curve.points ? 0.6 : 1) * Math.hypot(py === null ? dx : dx * (curve.points ? 1 : 0.1), dy);
        if (!best || distance < best.distance) best = { curve, i, distance };
      }
      return best;
    }

    // Of the sample of a curve next to an x; -1 if it has none that is a number.
    index(curve, x) {
      if (curve.points) {
        let best = -1;
        for (let i = 0; i < curve.x.length; i++) if (best < 0 || Math.abs(curve.x[i] - x) < Math.abs(curve.x[best] - x)) best = i;
        return best;
      }
      const right = d3.bisectLeft(curve.x, x), left = Math.max(0, right - 1);
      const order = right >= curve.x.length || x - curve.x[left] < curve.x[right] - x ? [left, right] : [right, left];
      for (const i of order) if (i < curve.x.length && Number.isFinite(curve.y[i])) return i;
      return -1;
    }

    show({ curve, i }) {
      this.at = { curve, i };
      const x = curve.x[i], unit = this.spec.x.unit ? ` ${this.spec.x.unit}` : "", yUnit = this.spec.y.unit ? ` ${this.spec.y.unit}` : "";
      const list = this.spec.nearest ? [curve] : this.shown();
      const rows = list.map((one) => ({ one, k: one === curve ? i : this.index(one, x) })).filter(({ k }) => k >= 0);
      const label = curve.labels && curve.labels[i];
      const head = label && !curve.points ? label : label || `${numberText(x)}${unit}`;
      this.tip.replaceChildren(Object.assign(document.createElement("b"), { textContent: head }));
      for (const { one, k } of rows) {
        const line = document.createElement("span");
        line.innerHTML = `<svg width="16" height="8" aria-hidden="true"><path class="curve ${one.look}" d="M0 4h16"/></svg>`;
        line.append(`${one.name}: ${valueText(one, k)}${yUnit}`);
        this.tip.append(line);
      }
      this.status.textContent = [head, ...rows.map(({ one, k }) => `${one.name} ${valueText(one, k)}${yUnit}`)].join("; ");
      this.tip.hidden = false;
      this.drawCursor(x, rows);
    }

    drawCursor(x, rows) {
      const { left, right, top, bottom } = this.box, px = this.x(x);
      this.cursor.selectAll("*").remove();
      const inside = px >= left - 1 && px <= right + 1;
      if (inside) {
        this.cursor.append("line").attr("x1", px).attr("x2", px).attr("y1", top).attr("y2", bottom);
        for (const { one, k } of rows) {
          const y = this.y(one.y[k]);
          if (y >= top - 1 && y <= bottom + 1) this.cursor.append("circle").attr("class", `point ${one.look}`).attr("r", 3.5).attr("cx", this.x(one.x[k])).attr("cy", y);
        }
      }
      const frame = this.picture.clientWidth, scale = this.svg.node().getBoundingClientRect().width / this.width() || 1;
      const at = Math.min(right, Math.max(left, px)) * scale, wide = this.tip.offsetWidth;
      this.tip.style.left = `${Math.max(0, Math.min(frame - wide - 2, at + 14 + wide > frame ? at - wide - 14 : at + 14))}px`;
      this.tip.style.top = `${top * scale + 4}px`;
    }

    hide() {
      this.at = null;
      this.tip.hidden = true;
      if (this.cursor) this.cursor.selectAll("*").remove();
    }

    zoom(how) {
      if (how === "all") {
        this.all();
        this.at = null;
      } else {
        const factor = how === "in" ? 0.5 : 2, [a, b] = this.window.x;
        const centre = this.at ? this.at.curve.x[this.at.i] : (a + b) / 2;
        const span = Math.min((b - a) * factor, this.extent[1] - this.extent[0]);
        this.move(centre - (span * (centre - a)) / (b - a), span);
        if (this.window.y && !this.spec.nearest) this.window.y = this.spec.y.range && factor > 1 ? this.spec.y.range.slice() : this.window.y;
      }
      this.draw();
    }

    // A window of that width, inside of what there is.
    move(start, span) {
      const low = Math.max(this.extent[0], Math.min(start, this.extent[1] - span));
      this.window.x = [low, low + span];
    }

    key(event) {
      const steps = { ArrowLeft: -1, ArrowRight: 1 }[event.key], [a, b] = this.window.x;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (steps && event.shiftKey) {
        this.move(a + steps * 0.25 * (b - a), b - a);
        this.draw();
      } else if (steps) this.step(steps);
      else if (event.key === "Home" || event.key === "End") this.to(event.key === "Home" ? a : b);
      else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
        if (!this.spec.nearest) return;
        this.change(event.key === "ArrowUp" ? 1 : -1);
      } else if (event.key === "+" || event.key === "=") this.zoom("in");
      else if (event.key === "-") this.zoom("out");
      else if (event.key === "0") this.zoom("all");
      else if (event.key === "Escape") this.hide();
      else return;
      event.preventDefault();
    }

    step(steps) {
      if (!this.at) return this.to((this.window.x[0] + this.window.x[1]) / 2);
      const { curve, i } = this.at;
      let k = i + steps;
      while (k >= 0 && k < curve.x.length && !Number.isFinite(curve.y[k])) k += steps;
      if (k < 0 || k >= curve.x.length) return;
      if (curve.x[k] < this.window.x[0] || curve.x[k] > this.window.x[1]) {
        this.move(curve.x[k] - (this.window.x[1] - this.window.x[0]) / 2, this.window.x[1] - this.window.x[0]);
        this.at = { curve, i: k };
        return this.draw();
      }
      this.show({ curve, i: k });
    }

    to(x) {
      const curve = this.shown()[0], i = curve ? this.index(curve, x) : -1;
      if (i >= 0) this.show({ curve, i });
    }

    change(steps) {
      const shown = this.shown();
      if (!this.at) return this.step(0);
      const x = this.at.curve.x[this.at.i], next = shown[(shown.indexOf(this.at.curve) + steps + shown.length) % shown.length];
      const i = this.index(next, x);
      if (i >= 0) this.show({ curve: next, i });
    }
  }

  // One legend for all panels of a figure: what is of one name looks alike in them.
  function makeLegend(figure, charts) {
    const legend = figure.querySelector(".legend"), groups = new Map();
    for (const chart of charts) {
      for (const curve of chart.curves) {
        const name = GROUPS[curve.role] || curve.name;
        groups.set(name, [...(groups.get(name) || []), curve]);
      }
    }
    if (figure.querySelectorAll(".panel").length > 1) groups.delete("load"); // a panel of one curve has its name
    const isShown = (curves) => curves.some((curve) => curve.shown);
    const leftOut = document.createElement("span"); // on paper, which has no buttons to press
    leftOut.className = "left-out";
    const tellLeftOut = () => {
      const names = [...groups].filter(([, curves]) => !isShown(curves)).map(([name]) => name);
      leftOut.textContent = names.length ? `not drawn: ${names.join(", ")}` : "";
    };
    for (const [name, curves] of groups) {
      const button = document.createElement("button");
      button.type = "button";
      const swatch = curves[0].points ? `<circle class="point ${curves[0].look}" cx="10" cy="5" r="4"/>` : `<path class="curve ${curves[0].look}" d="M0 5h20"/>`;
      button.innerHTML = `<svg width="20" height="10" aria-hidden="true">${swatch}</svg>`;
      button.append(name);
      const tell = () => button.setAttribute("aria-pressed", String(isShown(curves)));
      button.addEventListener("click", () => {
        const shown = !isShown(curves);
        curves.forEach((curve) => { curve.shown = shown; });
        tell();
        tellLeftOut();
        charts.forEach((chart) => chart.draw());
      });
      tell();
      legend.append(button);
    }
    tellLeftOut();
    legend.append(leftOut);
    const bands = charts.flatMap((chart) => chart.spec.bands || []);
    for (const label of new Set(bands.map((band) => band.label))) {
      const entry = document.createElement("span");
      const { kind } = bands.find((band) => band.label === label);
      entry.innerHTML = `<svg width="20" height="10" aria-hidden="true"><rect class="band ${kind}" width="20" height="10"/></svg>`;
      entry.append(label);
      legend.append(entry);
    }
    const marked = charts.find((chart) => (chart.spec.marks || []).length);
    if (marked) {
      const entry = document.createElement("span");
      entry.innerHTML = '<svg width="20" height="10" aria-hidden="true"><path class="mark" d="M10 9l-4 -7h8z"/></svg>';
      entry.append(marked.spec.markName);
      legend.append(entry);
    }
  }

  const charts = [...document.querySelectorAll("[data-figure]")].map((panel, i) => new Chart(panel, content.figures[panel.id], i));
  for (const figure of new Set(charts.map((chart) => chart.figure))) makeLegend(figure, charts.filter((chart) => chart.figure === figure));
  const redraw = () => charts.forEach((chart) => chart.draw());
  const print = (printing) => {
    if (printing) document.documentElement.dataset.printing = "yes";
    else delete document.documentElement.dataset.printing;
    redraw();
  };
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => print(false));
  let width = document.documentElement.clientWidth, waiting = 0;
  addEventListener("resize", () => {
    if (document.documentElement.clientWidth === width) return;
    width = document.documentElement.clientWidth;
    cancelAnimationFrame(waiting);
    waiting = requestAnimationFrame(redraw);
  });
  return { charts, numberText };
})();
