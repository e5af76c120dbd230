"use strict";
// The front: every pair of objectives, three of them in space, and all as parallel coordinates.

const NEAR = 14;

/** A view of all solutions: a layer with all of them, kept until sizes, colours or ranges change, and marks above. */
class FrontView {
  constructor(state, label) {
    this.state = state;
    this.canvas = made("canvas", {role: "img", "aria-label": label, class: "chart"});
    this.layer = null;
    this.draw = onceAFrame(() => this.drawNow());
    new ResizeObserver(() => this.renew()).observe(this.canvas);
    state.on("chosen", this.draw);
    state.on("hovered", this.draw);
    state.on("pins", this.draw);
    state.on("ranges", () => this.renew());
    state.on("theme", () => this.renew());
    this.canvas.addEventListener("pointermove", (event) => this.moved(event));
    this.canvas.addEventListener("pointerleave", () => state.hover(null));
    this.canvas.addEventListener("click", (event) => this.clicked(event));
  }

  renew() {
    this.layer = null;
    this.draw();
  }

  drawNow() {
    const sheet = prepared(this.canvas);
    if (!sheet) return;
    drawLayer(this, sheet);
    for (const [kind, k] of this.state.marked()) this.mark(sheet.context, kind, k);
  }

  moved(event) {
    this.state.hover(this.nearest(...placeOf(event, this.canvas)), event);
  }

  clicked(event) {
    const found = this.nearest(...placeOf(event, this.canvas));
    if (found !== null) this.state.choose(found);
  }

  /** The solution that is drawn next to a place; null if none is near. */
  nearest(x, y) {
    if (!this.spots) return null;
    let [best, found] = [NEAR * NEAR, null];
    for (let k = 0; k < this.state.count; k += 1) {
      if (this.state.within[k] !== 1) continue;
      const across = this.spots[2 * k] - x;
      const down = this.spots[2 * k + 1] - y;
      const apart = across * across + down * down;
      if (apart < best) [best, found] = [apart, k];
    }
    return found;
  }

  mark(context, kind, k) {
    drawMark(context, kind, this.spots[2 * k], this.spots[2 * k + 1]);
  }

  /** All solutions as dots in the colours of their groups, those outside of the ranges faded below the others. */
  dots(context) {
    const size = this.state.count > 1500 ? 3 : 4;
    for (const inside of [0, 1]) {
      context.globalAlpha = inside ? 0.85 : 0.18;
      context.fillStyle = themed("muted");
      let group = null;
      for (let k = 0; k < this.state.count; k += 1) {
        if (this.state.within[k] !== inside) continue;
        if (inside && this.state.groupOf(k) !== group) {
          group = this.state.groupOf(k);
          context.fillStyle = seriesColour(group);
        }
        context.fillRect(this.spots[2 * k] - size / 2, this.spots[2 * k + 1] - size / 2, size, size);
      }
    }
    context.globalAlpha = 1;
  }
}

class PairView extends FrontView {
  constructor(state, across, up) {
    const [x, y] = [state.objectives[across], state.objectives[up]];
    super(state, `Front: ${y.name} against ${x.name}. Arrow keys go through the solutions.`);
    Object.assign(this, {across, up});
  }

  place({width, height}) {
    const box = {left: 62, right: width - 12, top: 24, bottom: height - 42};
    const [low, high] = this.state.ends;
    this.x = scale(low[this.across], high[this.across], box.left, box.right);
    this.y = scale(low[this.up], high[this.up], box.bottom, box.top);
    this.box = box;
    this.spots = new Float32Array(2 * this.state.count);
    for (let k = 0; k < this.state.count; k += 1) {
      this.spots[2 * k] = this.x.at(this.state.value(k, this.across));
      this.spots[2 * k + 1] = this.y.at(this.state.value(k, this.up));
    }
  }

  drawAll(context) {
    const {objectives} = this.state;
    drawAxes(context, this.box, this.x, this.y, {x: objectives[this.across].title, y: objectives[this.up].title});
    this.dots(context);
  }
}

class SpaceView extends FrontView {
  constructor(state, axes) {
    super(state, `Front in space: ${axes.map((k) => state.objectives[k].name).join(", ")}. Drag to turn.`);
    this.axes = axes;
    [this.turn, this.tilt] = [-0.6, 0.45];
    this.canvas.style.touchAction = "none";
    this.canvas.addEventListener("pointerdown", (event) => {
      this.held = {x: event.clientX, y: event.clientY, far: 0};
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointerup", () => {
      this.turned = this.held && this.held.far > 4;
      this.held = null;
    });
  }

  moved(event) {
    if (!this.held) {
      super.moved(event);
      return;
    }
    const [x, y] = [event.clientX - this.held.x, event.clientY - this.held.y];
    this.held = {x: event.clientX, y: event.clientY, far: this.held.far + Math.abs(x) + Math.abs(y)};
    this.turn += 0.01 * x;
    this.tilt = Math.min(Math.max(this.tilt + 0.01 * y, -1.5), 1.5);
    this.renew();
  }

  clicked(event) {
    if (!this.turned) super.clicked(event);
    this.turned = false;
  }

  /** Where a point of the unit cube is drawn. */
  seen(point) {
    const [x, y, z] = point.map((share) => share - 0.5);
    const [across, along] = [
      x * Math.cos(this.turn) - y * Math.sin(this.turn),
      x * Math.sin(this.turn) + y * Math.cos(this.turn),
    ];
    const up = z * Math.cos(this.tilt) - along * Math.sin(this.tilt);
    return [this.middle[0] + this.size * across, this.middle[1] - this.size * up];
  }

  place({width, height}) {
    this.middle = [width / 2, height / 2];
    this.size = 0.54 * Math.min(width, height);
    const [low, high] = this.state.ends;
    this.spots = new Float32Array(2 * this.state.count);
    for (let k = 0; k < this.state.count; k += 1) {
      const shares = this.axes.map((axis) => {
        const span = high[axis] - low[axis];
        return span > 0 ? (this.state.value(k, axis) - low[axis]) / span : 0.5;
      });
      this.spots.set(this.seen(shares), 2 * k);
    }
  }

  drawAll(context) {
    const [low, high] = this.state.ends;
    context.font = `12px ${themed("font")}`;
    context.strokeStyle = themed("line");
    context.lineWidth = 1;
    context.beginPath();
    for (let axis = 0; axis < 3; axis += 1) {
      for (const [a, b] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
        const [begin, end] = [0, 1].map((share) => this.seen(along(axis, share, a, b)));
        context.moveTo(...begin);
        context.lineTo(...end);
      }
    }
    context.stroke();
    this.dots(context);
    this.placeLabels(context);
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (const {text, colour, x, y} of this.labels) {
      context.fillStyle = themed(colour);
      context.fillText(text, x, y);
    }
  }

  /** Names and ends of the axes beside an outer edge each, where they cover neither one another nor the margin. */
  placeLabels(context) {
    const [low, high] = this.state.ends;
    const edges = this.axes.map((_, axis) => this.outerEdge(axis));
    this.labels = [];
    this.axes.forEach((objective, axis) => {
      const [a, b] = edges[axis];
      this.placeLabel(context, this.state.objectives[objective].title, "text", [0.5, 0.4, 0.6, 0.3, 0.7].map((share) => along(axis, share, a, b)));
    });
    this.axes.forEach((objective, axis) => {
      for (const [share, end] of [[0.07, low], [0.93, high]]) {
        this.placeLabel(context, shown(end[objective], 3), "muted", [along(axis, share, ...edges[axis])]);
      }
    });
  }

  /** Of the four edges along an axis the one that is drawn farthest from the middle, the lower one of two. */
  outerEdge(axis) {
    const far = ([a, b]) => {
      const [x, y] = this.seen(along(axis, 0.5, a, b));
      return Math.hypot(x - this.middle[0], y - this.middle[1]) + 0.01 * y;
    };
    return [[0, 0], [0, 1], [1, 0], [1, 1]].reduce((best, edge) => (far(edge) > far(best) ? edge : best));
  }

  /** Put a text beside one of some points of the cube, as near as it is free; leave it out where nothing is. */
  placeLabel(context, text, colour, points) {
    const [half, tall] = [context.measureText(text).width / 2 + 3, 9];
    const [across, down] = this.middle;
    for (let far = 10; far < 130; far += 5) {
      for (const point of points) {
        const [x0, y0] = this.seen(point);
        const apart = Math.hypot(x0 - across, y0 - down) || 1;
        const [right, below] = [(x0 - across) / apart, (y0 - down) / apart];
        const x = Math.min(Math.max(x0 + right * (far + half * Math.abs(right)), half), 2 * across - half);
        const y = Math.min(Math.max(y0 + below * (far + half * Math.abs(right)), tall), 2 * down - tall);
        const covered = this.labels.some((one) => Math.abs(one.x - x) < one.half + half && Math.abs(one.y - y) < 2 * tall);
        if (covered) continue;
        this.labels.push({text, colour, x, y, half, tall});
        return;
      }
    }
  }
}

/** A point of the unit cube: a share along one axis, and two along the others. */
function along(axis, share, first, second) {
  const rest = [first, second];
  return [0, 1, 2].map((k) => (k === axis ? share : rest.shift()));
}

class ParallelView extends FrontView {
  constructor(state) {
    super(state, "All objectives as parallel coordinates. Drag along an axis to keep a range.");
    this.canvas.style.touchAction = "none";
    this.canvas.addEventListener("pointerdown", (event) => {
      const [x, y] = placeOf(event, this.canvas);
      if (!this.xs) return;
      const axis = this.xs.findIndex((place) => Math.abs(place - x) < 18);
      if (axis < 0) return;
      this.held = {axis, from: y, moved: false};
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointerup", () => {
      if (this.held && !this.held.moved) state.keep(this.held.axis, null);
      this.brushed = this.held !== undefined && this.held !== null;
      this.held = null;
    });
  }

  place({width, height}) {
    const count = this.state.objectives.length;
    this.box = {left: 70, right: width - 70, top: 46, bottom: height - 22};
    this.xs = Array.from({length: count}, (_, k) =>
      count > 1 ? this.box.left + (k * (this.box.right - this.box.left)) / (count - 1) : width / 2,
    );
    this.apart = count > 1 ? this.xs[1] - this.xs[0] : width;
    const [low, high] = this.state.ends;
    this.ys = this.xs.map((_, k) => scale(low[k], high[k], this.box.bottom, this.box.top, 0));
  }

  moved(event) {
    const [, y] = placeOf(event, this.canvas);
    if (!this.held) {
      super.moved(event);
      return;
    }
    if (Math.abs(y - this.held.from) < 4 && !this.held.moved) return;
    this.held.moved = true;
    const ends = [y, this.held.from].map((place) =>
      this.ys[this.held.axis].value(Math.min(Math.max(place, this.box.top), this.box.bottom)),
    );
    this.state.keep(this.held.axis, [Math.min(...ends), Math.max(...ends)]);
  }

  clicked(event) {
    if (!this.brushed) super.clicked(event);
    this.brushed = false;
  }

  height(k, axis) {
    return this.ys[axis].at(this.state.value(k, axis));
  }

  nearest(x, y) {
    let [best, found] = [NEAR, null];
    if (!this.xs) return found;
    const next = this.xs.findIndex((place) => place >= x);
    const axis = next < 0 ? this.xs.length - 1 : Math.max(next, 1);
    for (let k = 0; k < this.state.count; k += 1) {
      if (this.state.within[k] !== 1) continue;
      let place = this.height(k, Math.min(axis, this.xs.length - 1));
      if (axis > 0 && axis < this.xs.length) {
        const share = Math.min(Math.max((x - this.xs[axis - 1]) / (this.xs[axis] - this.xs[axis - 1]), 0), 1);
        place = this.height(k, axis - 1) * (1 - share) + place * share;
      }
      if (Math.abs(place - y) < best) [best, found] = [Math.abs(place - y), k];
    }
    return found;
  }

  line(context, k) {
    context.beginPath();
    this.xs.forEach((x, axis) => context.lineTo(x, this.height(k, axis)));
    if (this.xs.length === 1) context.arc(this.xs[0], this.height(k, 0), 3, 0, 2 * Math.PI);
    context.stroke();
  }

  drawAll(context) {
    const {objectives, count, within, kept} = this.state;
    for (const inside of [0, 1]) {
      context.globalAlpha = inside ? Math.min(0.75, Math.max(0.06, 60 / count)) : Math.min(0.1, 12 / count);
      context.strokeStyle = themed("muted");
      context.lineWidth = 1;
      let group = null;
      for (let k = 0; k < count; k += 1) {
        if (within[k] !== inside) continue;
        if (inside && this.state.groupOf(k) !== group) {
          group = this.state.groupOf(k);
          context.strokeStyle = seriesColour(group);
        }
        this.line(context, k);
      }
    }
    context.globalAlpha = 1;
    context.font = `12px ${themed("font")}`;
    objectives.forEach((objective, axis) => {
      const x = this.xs[axis];
      context.strokeStyle = themed("text");
      context.beginPath();
      context.moveTo(x, this.box.top);
      context.lineTo(x, this.box.bottom);
      context.stroke();
      context.textAlign = "center";
      context.fillStyle = themed("text");
      context.fillText(objective.title, x, this.box.top - 30, Math.min(130, this.apart - 8));
      context.fillStyle = themed("muted");
      if (objective.levels) this.drawLevels(context, objective.levels, axis);
      else {
        context.fillText(shown(this.ys[axis].high, 4), x, this.box.top - 10);
        context.fillText(shown(this.ys[axis].low, 4), x, this.box.bottom + 16);
      }
      if (kept[axis]) {
        const [bottom, top] = kept[axis].map((value) => this.ys[axis].at(value));
        context.globalAlpha = 0.35;
        context.fillStyle = themed("accent");
        context.fillRect(x - 7, top, 14, bottom - top);
        context.globalAlpha = 1;
      }
    });
  }

  /** Names of the levels of an axis beside it, as many as there is room for. */
  drawLevels(context, levels, axis) {
    const every = Math.ceil((14 * levels.length) / (this.box.bottom - this.box.top));
    context.textAlign = "left";
    levels.forEach((level, k) => {
      if (k % every === 0) context.fillText(level, this.xs[axis] + 6, this.ys[axis].at(k) + 4, Math.min(this.apart, 80) - 10);
    });
  }

  mark(context, kind, k) {
    context.lineWidth = kind === "chosen" ? 3 : 2;
    context.strokeStyle = kind === "chosen" ? themed("accent") : kind === "pin" ? themed("second") : themed("text");
    this.line(context, k);
  }
}

/** Views of points: every pair of objectives, and the first three in space. */
function viewsOf(state) {
  const count = state.objectives.length;
  const pairs = [];
  for (let up = 1; up < count; up += 1) for (let across = 0; across < up; across += 1) pairs.push([across, up]);
  const views = [];
  if (count > 1) views.push(["Pairs", pairs.map((pair) => new PairView(state, ...pair)), `pairs pairs-${pairs.length}`]);
  if (count > 2) views.push(["Space", [new SpaceView(state, [0, 1, 2])], "single"]);
  return views;
}

/** Views behind tabs, and a button that shows all ranges again. */
function showViews(state, views, again) {
  state.views = views.flatMap(([, shapes]) => shapes);
  const panes = views.map(([, shapes, kind]) => made("div", {class: `views ${kind}`, role: "tabpanel"}, ...shapes.map(({canvas}) => canvas)));
  const tabs = views.map(([name], k) =>
    made("button", {type: "button", role: "tab", text: name, "aria-label": `${name} view`, onclick: () => turnTo(k)}),
  );
  const turnTo = (chosen) => {
    panes.forEach((pane, k) => (pane.hidden = k !== chosen));
    tabs.forEach((tab, k) => tab.setAttribute("aria-selected", String(k === chosen)));
  };
  const whole = made("button", {type: "button", text: "all ranges", title: "show everything again", onclick: again});
  byId("front").append(made("div", {class: "tabs", role: "tablist"}, ...tabs, whole), ...panes);
  state.on("ranges", () => (whole.hidden = state.kept.every((range) => !range)));
  whole.hidden = true;
  turnTo(0);
}
