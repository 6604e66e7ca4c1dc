"use strict";
// A figure: axes, shaded ranges, curves with their names, critical speeds. By D3, as SVG.
const PRINTED = 655, GAP = 12, SMALL = 420, // width on paper, between panels, and of a small panel [px]
  MARGIN = { top: 26, right: 44, bottom: 44, left: 72 }, // around the axes
  NARROW_MARGIN = { top: 16, right: 12, bottom: 32, left: 46 };
const LETTER = 6.5; // width of one in names [px]
const DASHES = 3, COLOURS = 8; // of curves, in report.css

class Picture {
  constructor(panel, spec, index) {
    this.panel = panel;
    this.figure = panel.closest("figure");
    this.beside = Number(this.figure.dataset.columns);
    this.spec = spec;
    this.clip = `clip-${index}`;
    this.picture = panel.querySelector(".picture");
    this.curves = spec.curves.map((curve) => ({ ...curve, x: array(curve.x), y: array(curve.y), low: curve.low === undefined ? null : array(curve.low) }));
    let free = 0;
    for (const curve of this.curves) {
      const number = curve.role ? 0 : curve.colour === undefined ? free++ : curve.colour;
      curve.look = curve.role ? `role-${curve.role}` : `c${(number % COLOURS) + 1} d${Math.floor(number / COLOURS) % DASHES}`;
    }
    this.extent = spec.x.range || [d3.min(this.curves, (c) => d3.min(c.x)), d3.max(this.curves, (c) => d3.max(c.x))];
    if (this.extent[0] === this.extent[1]) this.extent = [this.extent[0] - 1, this.extent[1] + 1];
    this.all();
  }

  // The window that shows everything.
  all() {
    this.window = { x: this.extent.slice(), y: this.spec.y.range ? this.spec.y.range.slice() : null };
  }

  shown() {
    return this.curves.filter((curve) => curve.shown);
  }

  width() {
    return document.documentElement.dataset.printing ? (PRINTED - GAP * (this.beside - 1)) / this.beside : Math.max(200, this.picture.clientWidth);
  }

  // The y that all shown curves have within the window.
  yDomain() {
    if (this.window.y) return this.window.y;
    const [a, b] = this.window.x;
    let low = Infinity, high = -Infinity;
    for (const curve of this.shown()) {
      for (let i = 0; i < curve.x.length; i++) {
        if (curve.x[i] < a || curve.x[i] > b || !Number.isFinite(curve.y[i])) continue;
        const least = curve.low ? curve.low[i] : curve.y[i];
        if (least < low) low = least;
        if (curve.y[i] > high) high = curve.y[i];
      }
    }
    if (low > high) [low, high] = [0, 1];
    if (this.spec.y.zero) low = Math.min(0, low);
    const room = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [this.spec.y.zero && low === 0 ? 0 : low - room, high + room];
  }

  draw() {
    const width = this.width(), isSmall = width < SMALL;
    const height = Math.round(isSmall ? Math.max(118, 0.6 * width) : Math.max(200, Math.min(360, 0.42 * width)));
    const margin = { ...(isSmall ? NARROW_MARGIN : MARGIN) };
    this.isSmall = isSmall;
    if (this.spec.x.ticks) margin.bottom = 70;
    const ends = this.shown().filter((curve) => curve.end).map((curve) => curve.end.length);
    if (ends.length || (this.spec.marks && this.spec.marks.length)) margin.top += 16;
    margin.right = Math.max(margin.right, 8 + LETTER * (d3.max(ends) || 0));
    this.x = d3.scaleLinear(this.window.x, [margin.left, width - margin.right]);
    this.y = d3.scaleLinear(this.yDomain(), [height - margin.bottom, margin.top]);
    this.box = { left: margin.left, right: width - margin.right, top: margin.top, bottom: height - margin.bottom };
    this.picture.querySelectorAll("svg").forEach((old) => old.remove());
    const svg = d3.select(this.picture).append("svg").attr("viewBox", `0 0 ${width} ${height}`)
      .attr("width", width).attr("height", height).attr("aria-hidden", "true").classed("small", isSmall);
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
    this.drawNames();
    this.figure.dataset.drawn = "yes";
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
    const many = Math.max(2, Math.round((right - left) / (this.isSmall ? 55 : 90)));
    const bottomAxis = d3.axisBottom(this.x).tickSize(-(bottom - top)).tickPadding(7);
    if (x.ticks) {
      const seen = x.ticks.filter(([at]) => at >= this.window.x[0] && at <= this.window.x[1]);
      const step = Math.ceil(seen.length / Math.max(1, Math.floor((right - left) / 16)));
      const kept = seen.filter((_, i) => i % step === 0), names = new Map(kept);
      bottomAxis.tickValues(kept.map(([at]) => at)).tickFormat((at) => names.get(at));
    } else bottomAxis.ticks(many).tickFormat((value) => numberText(value, 6));
    const axis = this.svg.append("g").attr("class", "axis").attr("transform", `translate(0,${bottom})`).call(bottomAxis);
    if (x.ticks) axis.selectAll("text").attr("class", "slanted").attr("transform", "rotate(-40)").attr("text-anchor", "end").attr("dx", "-0.5em").attr("dy", "0.3em");
    const leftAxis = d3.axisLeft(this.y).ticks(this.isSmall ? 3 : 6).tickSize(-(right - left)).tickPadding(7);
    const largest = Math.max(...this.y.domain().map(Math.abs));
    const power = largest >= 1e5 || (largest < 1e-2 && largest > 0) ? 3 * Math.floor(Math.log10(largest) / 3) : 0;
    leftAxis.tickFormat((value) => numberText(value / 10 ** power, 6));
    this.svg.append("g").attr("class", "axis").attr("transform", `translate(${left},0)`).call(leftAxis);
    const unit = y.unit ? ` [${power ? `10${exponentText(power)} ` : ""}${y.unit}]` : power ? ` [10${exponentText(power)}]` : "";
    this.svg.append("text").attr("class", "label").attr("x", this.isSmall ? 2 : left).attr("y", this.isSmall ? 10 : 12).text((y.label + unit).trim());
    this.svg.append("text").attr("class", "label").attr("x", right).attr("y", height - (this.isSmall ? 2 : 5)).attr("text-anchor", "end").text(withUnit(x.label, x.unit));
  }

  drawCurve(inner, curve) {
    if (curve.points || curve.dots) {
      const name = curve.points ? `point ${curve.look}` : `dot ${curve.look}`;
      const size = { far: 3, margin: 5, inside: 5, measured: 4.5 }[curve.role] || 3;
      inner.selectAll(null).data(d3.range(curve.x.length).filter((i) => Number.isFinite(curve.y[i]))).enter().append("circle")
        .attr("class", name).attr("r", size).attr("cx", (i) => this.x(curve.x[i])).attr("cy", (i) => this.y(curve.y[i]));
    }
    if (curve.points) return;
    if (curve.low) {
      const area = d3.area().defined((i) => Number.isFinite(curve.y[i])).x((i) => this.x(curve.x[i]).toFixed(1))
        .y0((i) => this.y(curve.low[i]).toFixed(1)).y1((i) => this.y(curve.y[i]).toFixed(1));
      inner.insert("path", ":first-child").attr("class", `curve envelope ${curve.look}`).attr("d", area(d3.range(curve.x.length)));
      return;
    }
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
      if (curve.role === "mode") this.nameMode(curve);
      else if (last[0] < right - 12) above.push({ at: last[0], curve });
      else beside.push({ at: last[1], curve });
    }
    const spread = (ends, gap) => {
      ends.sort((a, b) => a.at - b.at);
      for (let i = 1; i < ends.length; i++) ends[i].at = Math.max(ends[i].at, ends[i - 1].at + gap);
    };
    const lift = (ends, gap, most) => { // what the others have pushed out goes back
      for (let i = ends.length - 1; i >= 0; i--) ends[i].at = Math.min(ends[i].at, i === ends.length - 1 ? most : ends[i + 1].at - gap);
    };
    spread(above, 15);
    spread(beside, 11);
    lift(beside, 11, bottom - 2);
    for (const { at, curve } of above) this.svg.append("text").attr("class", `end ${curve.look}`).attr("x", at).attr("y", top - 4).attr("text-anchor", "middle").text(curve.end);
    for (const { at, curve } of beside) this.svg.append("text").attr("class", `end ${curve.look}`).attr("x", right + 4).attr("y", at + 3).text(curve.end);
  }

  // At its first point in the picture, above the line.
  nameMode(curve) {
    const { left, top, bottom } = this.box;
    for (let i = 0; i < curve.x.length; i++) {
      const x = this.x(curve.x[i]), y = this.y(curve.y[i]);
      if (x < left - 1 || y < top || y > bottom) continue;
      this.svg.append("text").attr("class", `end ${curve.look}`).attr("x", x + 3).attr("y", y - 3).text(curve.end);
      return;
    }
  }

  // Names of points, where none covers another or is nearer to another point; the first have the first choice.
  drawNames() {
    const named = this.shown().filter((curve) => curve.names).reverse(), height = 12;
    const inside = ([x, y]) => x >= this.box.left && x <= this.box.right && y >= this.box.top && y <= this.box.bottom;
    const points = named.flatMap((curve) => curve.names.map((name, i) => ({ name, at: [this.x(curve.x[i]), this.y(curve.y[i])] }))).filter((one) => inside(one.at));
    const taken = points.map(({ at: [x, y] }) => [x - 3, y - 3, x + 3, y + 3]);
    for (const { name, at: [x, y] } of points) {
      const width = LETTER * name.length;
      for (const [a, b] of [[x - 5 - width, y - 9 - height], [x + 5, y + 9], [x - width / 2, y + 6], [x - width / 2, y - 6 - height]]) {
        const box = [a, b, a + width, b + height];
        if (a < this.box.left || box[2] > this.box.right || b < this.box.top || box[3] > this.box.bottom) continue;
        if (taken.some((one) => one[0] < box[2] && box[0] < one[2] && one[1] < box[3] && box[1] < one[3])) continue;
        const far = (one) => Math.hypot(Math.max(box[0] - one[0], one[0] - box[2], 0), Math.max(box[1] - one[1], one[1] - box[3], 0));
        if (points.some((one) => far(one.at) < far([x, y]))) continue;
        taken.push(box);
        this.svg.append("text").attr("class", "end named").attr("x", a).attr("y", b + height - 3).text(name);
        break;
      }
    }
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
}
