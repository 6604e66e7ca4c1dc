"use strict";
// Draws the figures of the report by D3: curves with their values under the pointer or by the arrow keys, zoom, a legend.
const report = (() => {
  const content = JSON.parse(document.getElementById("data").textContent);
  const decoded = [];
  const PRINTED = 655, MARGIN = { top: 26, right: 44, bottom: 44, left: 72 };
  const DASHES = 3, COLOURS = 8;
  const GROUPS = { order: "orders", mode: "modes" };

  function array(number) {
    if (!decoded[number]) {
      const text = atob(content.arrays[number]), bytes = new Uint8Array(text.length);
      for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
      decoded[number] = new Float32Array(bytes.buffer);
    }
    return decoded[number];
  }

  function exponentText(exponent) {
    return String(exponent).replace(/./g, (one) => (one === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(one)]));
  }

  // As numbers.py writes them.
  function numberText(value, digits = 5) {
    if (!Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const trim = (text) => (text.includes(".") ? text.replace(/0+$/, "").replace(/\.$/, "") : text).replace("-", "−");
    if (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6) return `${trim(mantissa)} × 10${exponentText(Number(exponent))}`;
    const text = trim(Number(`${mantissa}e${exponent}`).toFixed(Math.max(0, digits - 1 - Number(exponent))));
    return Math.abs(value) >= 1e4 ? text.replace(/\B(?=(\d{3})+(?!\d))/g, " ") : text;
  }

  const withUnit = (label, unit) => (unit ? `${label} [${unit.replace("m2", "m²")}]` : label);

  class Chart {
    constructor(figure, spec, index) {
      this.figure = figure;
      this.spec = spec;
      this.clip = `clip-${index}`;
      this.picture = figure.querySelector(".picture");
      this.status = figure.querySelector(".values");
      this.curves = spec.curves.map((curve) => ({ ...curve, x: array(curve.x), y: array(curve.y) }));
      let free = 0;
      for (const curve of this.curves) {
        const number = curve.role ? 0 : free++;
        curve.look = curve.role ? `role-${curve.role}` : `c${(number % COLOURS) + 1} d${Math.floor(number / COLOURS) % DASHES}`;
      }
      this.tip = document.createElement("div");
      this.tip.className = "tip";
      this.tip.hidden = true;
      this.extent = spec.x.range || [d3.min(this.curves, (c) => d3.min(c.x)), d3.max(this.curves, (c) => d3.max(c.x))];
      if (this.extent[0] === this.extent[1]) this.extent = [this.extent[0] - 1, this.extent[1] + 1];
      this.reset();
      this.makeLegend();
      this.listen();
      this.draw();
    }

    reset() {
      this.window = { x: this.extent.slice(), y: this.spec.y.range ? this.spec.y.range.slice() : null };
      this.at = null;
    }

    shown() {
      return this.curves.filter((curve) => curve.shown);
    }

    width() {
      return document.documentElement.dataset.printing ? PRINTED : Math.max(260, this.picture.clientWidth);
    }

    // The y that all shown curves have within the window.
    yDomain() {
      if (this.window.y) return this.window.y;
      const [a, b] = this.window.x;
      let low = Infinity, high = -Infinity;
      for (const curve of this.shown()) {
        for (let i = 0; i < curve.x.length; i++) {
          if (curve.x[i] < a || curve.x[i] > b || !Number.isFinite(curve.y[i])) continue;
          if (curve.y[i] < low) low = curve.y[i];
          if (curve.y[i] > high) high = curve.y[i];
        }
      }
      if (low > high) [low, high] = [0, 1];
      if (this.spec.y.zero) low = Math.min(0, low);
      const room = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
      return [this.spec.y.zero && low === 0 ? 0 : low - room, high + room];
    }

    draw() {
      const width = this.width(), height = Math.round(Math.max(230, Math.min(380, 0.52 * width)));
      const margin = { ...MARGIN };
      if (this.spec.x.ticks) margin.bottom = 84;
      if (this.spec.marks && this.spec.marks.length) margin.top = 42;
      if (width < 480) Object.assign(margin, { left: 60, right: 30 });
      this.x = d3.scaleLinear(this.window.x, [margin.left, width - margin.right]);
      this.y = d3.scaleLinear(this.yDomain(), [height - margin.bottom, margin.top]);
      this.box = { left: margin.left, right: width - margin.right, top: margin.top, bottom: height - margin.bottom };
      this.picture.querySelectorAll("svg").forEach((old) => old.remove());
      const svg = d3.select(this.picture).append("svg").attr("viewBox", `0 0 ${width} ${height}`)
        .attr("width", width).attr("height", height).attr("aria-hidden", "true");
      this.svg = svg;
      const { left, right, top, bottom } = this.box;
      svg.append("clipPath").attr("id", this.clip).append("rect")
        .attr("x", left).attr("y", top - 1).attr("width", right - left).attr("height", bottom - top + 2);
      this.drawBands();
      this.drawAxes(width, height);
      const inner = svg.append("g").attr("clip-path", `url(#${this.clip})`);
      for (const curve of this.shown()) this.drawCurve(inner, curve);
      this.drawEnds();
      this.drawMarks();
      this.cursor = svg.append("g").attr("class", "cursor");
      this.addBrush();
      this.picture.append(this.tip);
      this.figure.dataset.drawn = "yes";
      if (this.at) this.show(this.at);
    }

    drawBands() {
      const { left, right, top, bottom } = this.box;
      for (const band of this.spec.bands || []) {
        const a = Math.max(left, this.x(band.from)), b = Math.min(right, Math.max(this.x(band.to), this.x(band.from) + 1.5));
        if (b > a) {
          this.svg.append("rect").attr("class", `band ${band.kind}`).attr("x", a).attr("width", b - a).attr("y", top).attr("height", bottom - top);
        }
      }
    }

    drawAxes(width, height) {
      const { left, right, top, bottom } = this.box, { x, y } = this.spec;
      const many = Math.max(3, Math.round((right - left) / 90));
      const bottomAxis = d3.axisBottom(this.x).tickSize(-(bottom - top)).tickPadding(7);
      if (x.ticks) {
        const seen = x.ticks.filter(([at]) => at >= this.window.x[0] && at <= this.window.x[1]);
        const step = Math.ceil(seen.length / Math.max(1, Math.floor((right - left) / 16)));
        const kept = seen.filter((_, i) => i % step === 0), names = new Map(kept);
        bottomAxis.tickValues(kept.map(([at]) => at)).tickFormat((at) => names.get(at));
      } else bottomAxis.ticks(many).tickFormat((value) => numberText(value, 6));
      const axis = this.svg.append("g").attr("class", "axis").attr("transform", `translate(0,${bottom})`).call(bottomAxis);
      if (x.ticks) axis.selectAll("text").attr("class", "slanted").attr("transform", "rotate(-40)").attr("text-anchor", "end").attr("dx", "-0.5em").attr("dy", "0.3em");
      const leftAxis = d3.axisLeft(this.y).ticks(6).tickSize(-(right - left)).tickPadding(7);
      const largest = Math.max(...this.y.domain().map(Math.abs));
      const power = largest >= 1e5 || (largest < 1e-2 && largest > 0) ? 3 * Math.floor(Math.log10(largest) / 3) : 0;
      leftAxis.tickFormat((value) => numberText(value / 10 ** power, 6));
      this.svg.append("g").attr("class", "axis").attr("transform", `translate(${left},0)`).call(leftAxis);
      const unit = y.unit ? ` [${power ? `10${exponentText(power)} ` : ""}${y.unit}]` : power ? ` [10${exponentText(power)}]` : "";
      this.svg.append("text").attr("class", "label").attr("x", left).attr("y", 12).text(y.label + unit);
      this.svg.append("text").attr("class", "label").attr("x", right).attr("y", height - 5).attr("text-anchor", "end").text(withUnit(x.label, x.unit));
    }

    drawCurve(inner, curve) {
      if (curve.points || curve.dots) {
        const name = curve.points ? `point ${curve.look}` : `dot ${curve.look}`;
        const size = { far: 3, margin: 5, inside: 5 }[curve.role] || 3;
        inner.selectAll(null).data(d3.range(curve.x.length).filter((i) => Number.isFinite(curve.y[i]))).enter().append("circle")
          .attr("class", name).attr("r", size).attr("cx", (i) => this.x(curve.x[i])).attr("cy", (i) => this.y(curve.y[i]));
      }
      if (curve.points) return;
      const line = d3.line().defined((i) => Number.isFinite(curve.y[i])).x((i) => this.x(curve.x[i]).toFixed(1)).y((i) => this.y(curve.y[i]).toFixed(1));
      inner.insert("path", ":first-child").attr("class", `curve ${curve.look}`).attr("d", line(d3.range(curve.x.length)));
    }

    // Names of orders and modes where their lines leave the picture: above it, or at its right.
    drawEnds() {
      const { right, top, bottom } = this.box, above = [], beside = [];
      for (const curve of this.shown().filter((one) => one.end)) {
        let last = null;
        for (let i = 0; i < curve.x.length; i++) {
          const x = this.x(curve.x[i]), y = this.y(curve.y[i]);
          if (x >= this.box.left - 1 && x <= right + 1 && y >= top - 1 && y <= bottom + 1) last = [x, y];
        }
        if (!last) continue;
        if (last[0] < right - 12) above.push({ at: last[0], curve });
        else beside.push({ at: last[1], curve });
      }
      const spread = (ends, gap) => {
        ends.sort((a, b) => a.at - b.at);
        for (let i = 1; i < ends.length; i++) ends[i].at = Math.max(ends[i].at, ends[i - 1].at + gap);
      };
      spread(above, 15);
      spread(beside, 11);
      for (const { at, curve } of above) this.svg.append("text").attr("class", `end ${curve.look}`).attr("x", at).attr("y", top - 4).attr("text-anchor", "middle").text(curve.end);
      for (const { at, curve } of beside) this.svg.append("text").attr("class", `end ${curve.look}`).attr("x", right + 4).attr("y", at + 3).text(curve.end);
    }

    drawMarks() {
      const { left, right, top } = this.box;
      let last = -Infinity;
      for (const [at, name] of [...(this.spec.marks || [])].sort((a, b) => a[0] - b[0])) {
        const x = this.x(at);
        if (x < left || x > right) continue;
        this.svg.append("path").attr("class", "mark").attr("d", `M${x} ${top}l-4 -7h8z`);
        if (x - last < 30) continue;
        this.svg.append("text").attr("class", "end").attr("x", x).attr("y", top - 9).attr("text-anchor", "middle").text(name);
        last = x;
      }
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

    makeLegend() {
      const legend = this.figure.querySelector(".legend"), groups = new Map();
      for (const curve of this.curves) {
        const name = GROUPS[curve.role] || curve.name;
        groups.set(name, [...(groups.get(name) || []), curve]);
      }
      for (const [name, curves] of groups) {
        const button = document.createElement("button");
        button.type = "button";
        const swatch = curves[0].points ? `<circle class="point ${curves[0].look}" cx="10" cy="5" r="4"/>` : `<path class="curve ${curves[0].look}" d="M0 5h20"/>`;
        button.innerHTML = `<svg width="20" height="10" aria-hidden="true">${swatch}</svg>`;
        button.append(name);
        const tell = () => button.setAttribute("aria-pressed", String(curves[0].shown));
        button.addEventListener("click", () => {
          const shown = !curves[0].shown;
          curves.forEach((curve) => { curve.shown = shown; });
          tell();
          this.draw();
        });
        tell();
        legend.append(button);
      }
      const told = new Set();
      for (const band of this.spec.bands || []) {
        if (told.has(band.label)) continue;
        told.add(band.label);
        const entry = document.createElement("span");
        entry.innerHTML = `<svg width="20" height="10" aria-hidden="true"><rect class="band ${band.kind}" width="20" height="10"/></svg>`;
        entry.append(band.label);
        legend.append(entry);
      }
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
        line.append(`${one.name}: ${numberText(one.y[k])}${yUnit}`);
        this.tip.append(line);
      }
      this.status.textContent = [head, ...rows.map(({ one, k }) => `${one.name} ${numberText(one.y[k])}${yUnit}`)].join("; ");
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
      if (how === "all") this.reset();
      else {
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

  const charts = [...document.querySelectorAll("[data-figure]")].map((figure, i) => new Chart(figure, content.figures[figure.id], i));
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
