"use strict";
// Curves of the chosen motion against time, within the limits that it keeps, with one cursor for all.

/** One quantity of all joints; values, or shares of their limits. */
class Profile {
  constructor(state, quantity) {
    Object.assign(this, {state, quantity});
    this.canvas = made("canvas", {role: "img", class: "chart", tabindex: 0});
    this.draw = onceAFrame(() => this.drawNow());
    this.layer = null;
    new ResizeObserver(() => this.renew()).observe(this.canvas);
    for (const event of ["chosen", "pins", "zoom", "joints", "shares", "theme"]) state.on(event, () => this.renew());
    state.on("time", this.draw);
    this.watch();
  }

  renew() {
    this.layer = null;
    this.draw();
  }

  /** Clicks set the cursor, drags zoom into a stretch of time, and a double click shows everything again. */
  watch() {
    const {canvas, state} = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.x) return;
      [this.from] = placeOf(event, canvas);
      this.to = this.from;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const [x] = placeOf(event, canvas);
      if (this.from === undefined) {
        if (this.x) this.tell(x, event);
        return;
      }
      this.to = x;
      this.draw();
    });
    canvas.addEventListener("pointerup", () => {
      if (this.from === undefined) return;
      const [begin, end] = [this.from, this.to].sort((a, b) => a - b);
      this.from = undefined;
      if (end - begin > 6) state.zoomTo([this.x.value(begin), this.x.value(end)]);
      else state.setTime(this.x.value(end));
      this.draw();
    });
    canvas.addEventListener("pointerleave", () => state.tip(null));
    canvas.addEventListener("dblclick", () => state.zoomTo(null));
    canvas.addEventListener("keydown", (event) => {
      const step = {ArrowLeft: -0.01, ArrowRight: 0.01}[event.key];
      if (!step) return;
      event.preventDefault();
      state.setTime(state.time + step * state.duration);
    });
  }

  /** Factor and offset that bring a joint's SI values onto the axis. */
  shownAs(joint) {
    const {low, high, factors} = this.quantity;
    const [lower, upper] = [low[joint], high[joint]];
    if (!this.state.shares || lower === null || upper === null) return [factors[joint], 0];
    const position = this.quantity.name === "position";
    const middle = position ? (lower + upper) / 2 : 0;
    const half = position ? (upper - lower) / 2 : Math.max(-lower, upper);
    return half > 0 ? [100 / half, middle] : [factors[joint], 0];
  }

  get title() {
    const {name, units} = this.quantity;
    const mixed = new Set(units).size > 1;
    if (this.state.shares && this.limited) return `${name} [% of the limit]`;
    return `${name} [${mixed ? [...new Set(units)].join(" or ") : units[0]}]`;
  }

  get limited() {
    return this.quantity.low.some((value) => value !== null);
  }

  place({width, height}) {
    const {state} = this;
    this.box = {left: 62, right: width - 10, top: 24, bottom: height - 24};
    const [begin, end] = state.zoom || [0, state.duration];
    this.x = scale(begin, end, this.box.left, this.box.right, 0);
    this.lines = [state.chosen, ...state.pins.filter((pin) => pin !== state.chosen)].map((row) => ({
      row,
      curve: state.motions.curves(row, this.quantity.name),
    }));
    let [low, high] = [Infinity, -Infinity];
    for (const {curve} of this.lines) {
      for (const joint of state.joints) {
        const [factor, offset] = this.shownAs(joint);
        for (let k = 0; k < curve.t.length; k += 1) {
          if (curve.t[k] < begin || curve.t[k] > end) continue;
          const value = (curve.y[joint][k] - offset) * factor;
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
    }
    if (!(high >= low)) [low, high] = [-1, 1];
    const spare = Math.max(high - low, 1e-9);
    for (const bound of this.bounds()) {
      if (bound > high && bound < high + spare) high = bound;
      if (bound < low && bound > low - spare) low = bound;
    }
    this.y = scale(low, high, this.box.bottom, this.box.top, 0.06);
  }

  /** Whether all joints that are shown have the same limits, on the axis. */
  get alike() {
    return this.bounds().length <= 2;
  }

  /** Limits of the joints that are shown, on the axis. */
  bounds() {
    const found = [];
    for (const joint of this.state.joints) {
      const [factor, offset] = this.shownAs(joint);
      for (const bound of [this.quantity.low[joint], this.quantity.high[joint]]) {
        if (bound !== null) found.push((bound - offset) * factor);
      }
    }
    return [...new Set(found)];
  }

  drawNow() {
    const sheet = prepared(this.canvas);
    if (!sheet) return;
    drawLayer(this, sheet);
    const {context} = sheet;
    const x = this.x.at(this.state.time);
    if (x >= this.box.left - 1 && x <= this.box.right + 1) {
      context.strokeStyle = themed("accent");
      context.lineWidth = 1.5;
      context.beginPath();
      context.moveTo(x, this.box.top);
      context.lineTo(x, this.box.bottom);
      context.stroke();
    }
    if (this.from !== undefined && Math.abs(this.to - this.from) > 6) {
      context.globalAlpha = 0.2;
      context.fillStyle = themed("accent");
      context.fillRect(this.from, this.box.top, this.to - this.from, this.box.bottom - this.box.top);
      context.globalAlpha = 1;
    }
  }

  drawAll(context) {
    const ends = `${this.title} against time [s], 0 to ${shown(this.state.duration)} s`;
    this.canvas.setAttribute("aria-label", `${ends}. Left and right move the cursor; drag to zoom.`);
    drawAxes(context, this.box, this.x, this.y, {y: this.title});
    context.save();
    context.beginPath();
    context.rect(this.box.left, this.box.top, this.box.right - this.box.left, this.box.bottom - this.box.top);
    context.clip();
    this.drawBands(context);
    for (const {row, curve} of [...this.lines].reverse()) {
      const chosen = row === this.state.chosen;
      for (const joint of this.state.joints) {
        const [factor, offset] = this.shownAs(joint);
        context.strokeStyle = seriesColour(joint);
        context.setLineDash(chosen ? seriesDash(joint) : [3, 4]);
        context.lineWidth = chosen ? 1.8 : 1;
        context.globalAlpha = chosen ? 1 : 0.75;
        context.beginPath();
        curve.t.forEach((time, k) =>
          context.lineTo(this.x.at(time), this.y.at((curve.y[joint][k] - offset) * factor)),
        );
        context.stroke();
      }
    }
    context.restore();
  }

  /** What is beyond the limits of all joints that are shown is shaded; a limit of one of them is a line. */
  drawBands(context) {
    const bounds = this.bounds();
    const {left, right, top, bottom} = this.box;
    if (!bounds.length) return;
    const limited = [...this.state.joints].every((joint) => this.quantity.high[joint] !== null);
    if (limited) {
      context.fillStyle = themed("beyond");
      const [low, high] = [this.y.at(Math.min(...bounds)), this.y.at(Math.max(...bounds))];
      if (high > top) context.fillRect(left, top, right - left, high - top);
      if (low < bottom) context.fillRect(left, low, right - left, bottom - low);
    }
    context.lineWidth = 1;
    context.setLineDash([5, 4]);
    for (const joint of this.state.joints) {
      const [factor, offset] = this.shownAs(joint);
      context.strokeStyle = this.alike ? themed("limit") : seriesColour(joint);
      context.beginPath();
      for (const bound of [this.quantity.low[joint], this.quantity.high[joint]]) {
        if (bound === null) continue;
        const at = this.y.at((bound - offset) * factor);
        context.moveTo(left, at);
        context.lineTo(right, at);
      }
      context.stroke();
    }
    context.setLineDash([]);
  }

  /** The values at a place, beside the pointer. */
  tell(x, event) {
    const time = Math.min(Math.max(this.x.value(x), 0), this.state.duration);
    const {curve} = this.lines[0];
    const told = [...this.state.joints].map((joint) => {
      const value = valueAt(curve, joint, time);
      const {factors, units, low, high} = this.quantity;
      const limit = value < 0 ? low[joint] : high[joint];
      const share = limit && this.quantity.name !== "position" ? `, ${shown((100 * value) / limit, 3)} %` : "";
      return `${this.state.names[joint]} ${shown(value * factors[joint])} ${units[joint]}${share}`;
    });
    this.state.tip([`${shown(time, 4)} s`, ...told], event);
  }
}
