"use strict";
// The page of a study: fronts of all cells over one another, and cells as lines from their levels to what they found.

/** Cells, and the points of their fronts, which the views of a front take for its solutions. */
class StudyState extends Told {
  constructor(data, array) {
    super(data);
    Object.assign(this, {objectives: data.objectives, factors: data.factors, cells: data.cells, pins: []});
    this.F = array(data.F);
    this.owner = array(data.cell);
    this.count = this.owner.length;
    this.within = new Uint8Array(this.count).fill(1);
    this.begins = new Uint32Array(this.cells.length + 1);
    for (const cell of this.owner) this.begins[cell + 1] += 1;
    for (let k = 0; k < this.cells.length; k += 1) this.begins[k + 1] += this.begins[k];
    this.left = this.factors.map(() => new Set());
    this.colouring = Math.max(this.factors.findIndex(({levels}) => levels.length > 1), 0);
    Object.assign(this, {hovered: null, point: null});
    this.lines = new Lines(this, data, array);
    this.chosen = this.lines.greatest("hypervolume");
    this.measure();
  }

  get kept() {
    return this.lines.kept;
  }

  /** An objective of a point in the unit in which it is shown. */
  value(point, objective) {
    return this.F[point * this.objectives.length + objective] * this.objectives[objective].factor;
  }

  /** Group of a point: the level of the factor that gives the colours. */
  groupOf(point) {
    return this.groupOfCell(this.owner[point]);
  }

  groupOfCell(cell) {
    return this.factors.length ? this.cells[cell].levels[this.colouring] : 0;
  }

  points(cell) {
    return Array.from({length: this.begins[cell + 1] - this.begins[cell]}, (_, k) => this.begins[cell] + k);
  }

  /** The point of a cell's knee; null if nothing was found. */
  knee(cell) {
    const place = this.data.knee[cell];
    return place === null ? null : this.begins[cell] + place;
  }

  /** The points of the hovered, the pinned and the chosen cell, and the knees of these. */
  marked() {
    const marks = [];
    const add = (cell, kind, knee) => {
      for (const point of this.points(cell)) marks.push([kind, point]);
      if (this.knee(cell) !== null) marks.push([knee, this.knee(cell)]);
    };
    for (const pin of this.pins) if (pin !== this.chosen) add(pin, "of pin", "pin");
    if (this.hovered !== null && this.hovered !== this.chosen) add(this.hovered, "of hover", "hover");
    add(this.chosen, "of chosen", "chosen");
    if (this.point !== null) marks.push(["hover", this.point]);
    return marks;
  }

  choose(point) {
    this.chooseCell(this.owner[point]);
  }

  chooseCell(cell) {
    if (cell === this.chosen) return;
    this.chosen = cell;
    this.tell("chosen");
  }

  hover(point, event) {
    this.hoverCell(point === null ? null : this.owner[point], event, point);
  }

  hoverCell(cell, event, point = null) {
    if (cell !== this.hovered || point !== this.point) {
      Object.assign(this, {hovered: cell, point});
      this.tell("hovered");
    }
    this.tell("tip", cell === null ? null : this.told(cell, point), event);
  }

  /** What is told of a cell, and of one of its points. */
  told(cell, point = null) {
    const values = point === null ? [] : this.objectives.map(({name, unit}, k) => `${name} ${shown(this.value(point, k))} ${unit}`);
    return [...this.named(cell), `hypervolume ${shown(this.lines.of(cell, "hypervolume"))}`, ...values];
  }

  /** The levels of a cell, and its repeat. */
  named(cell) {
    const {levels, repeat} = this.cells[cell];
    return [...this.factors.map((factor, k) => `${factor.name} ${factor.levels[levels[k]]}`), `repeat ${repeat}`];
  }

  pin(cell) {
    this.pins = this.pins.includes(cell) ? this.pins.filter((pin) => pin !== cell) : [...this.pins, cell].slice(-4);
    this.tell("pins");
  }

  /** Leave a level out, or show it again. */
  toggle(factor, level, alone) {
    const {levels} = this.factors[factor];
    if (alone) this.left[factor] = new Set([...levels.keys()].filter((k) => k !== level));
    else if (!this.left[factor].delete(level)) this.left[factor].add(level);
    if (this.left[factor].size === levels.length) this.left[factor].clear();
    this.sift();
  }

  /** Cells of levels that are left out are hidden, those outside of a kept range fade. */
  sift() {
    this.cells.forEach(({levels}, cell) => {
      const hidden = levels.some((level, factor) => this.left[factor].has(level));
      this.lines.within[cell] = hidden ? 2 : this.lines.keeps(cell) ? 1 : 0;
    });
    for (let point = 0; point < this.count; point += 1) this.within[point] = this.lines.within[this.owner[point]];
    this.measure();
    this.tell("ranges");
  }

  /** The ends of all objectives among the points that are not hidden. */
  measure() {
    const ends = [this.objectives.map(() => Infinity), this.objectives.map(() => -Infinity)];
    for (let point = 0; point < this.count; point += 1) {
      if (this.within[point] === 2) continue;
      for (let k = 0; k < this.objectives.length; k += 1) {
        const value = this.value(point, k);
        if (value < ends[0][k]) ends[0][k] = value;
        if (value > ends[1][k]) ends[1][k] = value;
      }
    }
    this.ends = ends.map((end) => end.map((value) => (Number.isFinite(value) ? value : 0)));
  }
}

/** All cells as what parallel coordinates draw: factors and results are the axes. */
class Lines {
  constructor(study, data, array) {
    this.study = study;
    this.columns = data.columns;
    this.values = array(data.values);
    this.count = study.cells.length;
    this.within = new Uint8Array(this.count).fill(1);
    this.drawn = [...this.columns.keys()].filter((k) => this.columns[k].drawn);
    this.objectives = this.drawn.map((k) => this.columns[k]);
    this.kept = this.drawn.map(() => null);
    this.ends = [Math.min, Math.max].map((end) =>
      this.objectives.map(({levels}, axis) => {
        if (levels) return end(0, levels.length - 1);
        const found = Array.from({length: this.count}, (_, cell) => this.value(cell, axis)).filter(Number.isFinite);
        return found.length ? found.reduce((a, b) => end(a, b)) : 0;
      }),
    );
  }

  on(event, call) {
    this.study.on(event, call);
  }

  get hovered() {
    return this.study.hovered;
  }

  column(cell, column) {
    return this.values[cell * this.columns.length + column];
  }

  /** A value of a cell by the title of its column. */
  of(cell, title) {
    return this.column(cell, this.columns.findIndex((column) => column.title === title));
  }

  greatest(title) {
    let best = 0;
    for (let cell = 1; cell < this.count; cell += 1) if (this.of(cell, title) > this.of(best, title)) best = cell;
    return best;
  }

  value(cell, axis) {
    return this.column(cell, this.drawn[axis]);
  }

  groupOf(cell) {
    return this.study.groupOfCell(cell);
  }

  marked() {
    const {chosen, hovered, pins} = this.study;
    return [...pins.map((pin) => ["pin", pin]), ...(hovered === null ? [] : [["hover", hovered]]), ["chosen", chosen]];
  }

  choose(cell) {
    this.study.chooseCell(cell);
  }

  hover(cell, event) {
    this.study.hoverCell(cell, event);
  }

  keep(axis, range) {
    this.kept[axis] = range;
    this.study.sift();
  }

  keeps(cell) {
    return this.kept.every((range, axis) => !range || (this.value(cell, axis) >= range[0] && this.value(cell, axis) <= range[1]));
  }
}

/** The hypervolume of every cell against the individuals that it had evaluated. */
class CourseView extends FrontView {
  constructor(state, data, array) {
    super(state.lines, "Hypervolume of every cell against individuals evaluated.");
    [this.begins, this.evaluated, this.volumes] = ["begins", "evaluated", "volumes"].map((name) => array(data.course[name]));
  }

  place({width, height}) {
    this.box = {left: 62, right: width - 12, top: 24, bottom: height - 42};
    const known = (values) => [...values].filter(Number.isFinite);
    const greatest = (values) => known(values).reduce((a, b) => Math.max(a, b), 0);
    this.x = scale(0, greatest(this.evaluated), this.box.left, this.box.right, 0.02);
    this.y = scale(known(this.volumes).reduce((a, b) => Math.min(a, b), greatest(this.volumes)), greatest(this.volumes), this.box.bottom, this.box.top);
    this.spots = Float32Array.from({length: 2 * this.volumes.length}, (_, k) =>
      k % 2 ? this.y.at(this.volumes[k >> 1]) : this.x.at(this.evaluated[k >> 1]));
  }

  drawAll(context) {
    drawAxes(context, this.box, this.x, this.y, {x: "individuals evaluated", y: "hypervolume"});
    context.lineWidth = 1;
    for (const inside of [0, 1]) {
      context.globalAlpha = inside ? 0.75 : 0.15;
      for (let cell = 0; cell < this.state.count; cell += 1) {
        if (this.state.within[cell] !== inside) continue;
        context.strokeStyle = inside ? seriesColour(this.state.groupOf(cell)) : themed("muted");
        this.line(context, cell);
      }
    }
    context.globalAlpha = 1;
  }

  line(context, cell) {
    context.beginPath();
    for (let k = this.begins[cell]; k < this.begins[cell + 1]; k += 1) {
      if (Number.isFinite(this.volumes[k])) context.lineTo(this.spots[2 * k], this.spots[2 * k + 1]);
    }
    context.stroke();
  }

  mark(context, kind, cell) {
    context.lineWidth = kind === "chosen" ? 3 : 2;
    context.strokeStyle = themed({chosen: "accent", pin: "second"}[kind] || "text");
    this.line(context, cell);
  }

  /** The cell whose course passes nearest to a place. */
  nearest(x, y) {
    let [best, found] = [NEAR, null];
    for (let cell = 0; this.spots && cell < this.state.count; cell += 1) {
      if (this.state.within[cell] !== 1) continue;
      for (let k = this.begins[cell] + 1; k < this.begins[cell + 1]; k += 1) {
        const [x0, y0, x1, y1] = this.spots.subarray(2 * k - 2, 2 * k + 2);
        if (x < x0 || x > x1) continue;
        const apart = Math.abs(y0 + (x1 > x0 ? ((y1 - y0) * (x - x0)) / (x1 - x0) : 0) - y);
        if (apart < best) [best, found] = [apart, cell];
      }
    }
    return found;
  }
}

/** Buttons of all levels, and of the factor that gives the colours. */
function showFactors(state) {
  const paint = [];
  const rows = state.factors.map(({name, levels}, factor) => {
    const colours = made("button", {
      type: "button",
      text: `colour by ${name}`,
      onclick: () => {
        state.colouring = factor;
        state.tell("ranges");
      },
    });
    const buttons = levels.map((level, k) =>
      made("button", {
        type: "button",
        class: "joint",
        "aria-label": `${name} ${level}`,
        title: "show or hide this level; with shift, it alone",
        onclick: (event) => state.toggle(factor, k, event.shiftKey || event.altKey),
      }, made("span", {class: "line"}), level),
    );
    paint.push(() => {
      colours.setAttribute("aria-pressed", String(state.colouring === factor));
      buttons.forEach((button, k) => {
        button.setAttribute("aria-pressed", String(!state.left[factor].has(k)));
        button.firstChild.style.background = state.colouring === factor ? seriesColour(k) : "transparent";
      });
    });
    return made("div", {class: "row factor"}, colours, ...buttons);
  });
  const counted = made("p", {class: "note", role: "status"});
  paint.push(() => {
    const count = state.lines.within.filter((one) => one === 1).length;
    counted.textContent = `${count} of ${state.cells.length} cells shown`;
  });
  byId("factors").append(...rows, counted);
  for (const event of ["ranges", "theme"]) state.on(event, () => paint.forEach((call) => call()));
  paint.forEach((call) => call());
}

/** The chosen cell beside the pinned ones: what it found, its knee, and where its run is. */
function showCell(state) {
  const draw = () => {
    const cells = [state.chosen, ...state.pins.filter((pin) => pin !== state.chosen)];
    const {name, seed, run, link} = state.cells[state.chosen];
    byId("cell").textContent = name;
    const head = made("tr", {}, made("th"), ...cells.map((cell, k) =>
      made("th", {}, made("span", {class: k ? "swatch second" : "swatch accent"}), state.named(cell).join(", "))));
    const told = state.lines.columns.map(({title, levels}, k) => [title, levels, k]).filter(([, levels]) => !levels);
    const rows = told.map(([title, , column]) => [title, (cell) => shown(state.lines.column(cell, column), 6)]);
    rows.push(["solutions", (cell) => state.cells[cell].size], ["failed", (cell) => state.cells[cell].failures]);
    const lines = rows.map(([title, of]) =>
      made("tr", {}, made("th", {scope: "row", text: title}), ...cells.map((cell) => made("td", {class: "number", text: of(cell)}))));
    byId("values").replaceChildren(made("table", {}, made("thead", {}, head), made("tbody", {}, ...lines)));
    byId("known").replaceChildren(
      made("p", {}, made("b", {text: "Its run: "}), made("a", {href: link.to, text: link.text === "page" ? "its page" : "its folder"}), `, seed ${seed}`),
      made("p", {}, made("b", {text: "Its page, with every motion: "}), made("code", {text: `trajevo open ${run}`})),
    );
    byId("pin").textContent = state.pins.includes(state.chosen) ? "unpin" : "pin to compare";
    byId("said").textContent = `Cell ${state.told(state.chosen).join("; ")}`;
    const address = `#cell=${encodeURIComponent(name)}`;
    if (window.location.hash !== address) window.history.replaceState(null, "", address);
  };
  byId("pin").addEventListener("click", () => state.pin(state.chosen));
  byId("previous").addEventListener("click", () => stepTo(state, -1));
  byId("next").addEventListener("click", () => stepTo(state, 1));
  byId("front").addEventListener("keydown", (event) => {
    const step = {ArrowLeft: -1, ArrowRight: 1, ArrowUp: -1, ArrowDown: 1}[event.key];
    if (!step) return;
    event.preventDefault();
    stepTo(state, step);
  });
  state.on("chosen", draw);
  state.on("pins", draw);
  draw();
}

/** Go to the next cell that is shown. */
function stepTo(state, step) {
  let next = state.chosen + step;
  while (next >= 0 && next < state.cells.length && state.lines.within[next] !== 1) next += step;
  if (next >= 0 && next < state.cells.length) state.chooseCell(next);
}

/** The table of cells: a click chooses, a click on a header sorts, and cells that are hidden are not listed. */
function showTable(state) {
  const rows = [...byId("cells").tBodies[0].rows];
  const chosen = () =>
    rows.forEach((row) => row.classList.toggle("chosen", Number(row.dataset.row) === state.chosen));
  for (const row of rows) {
    row.addEventListener("click", (event) => {
      if (!event.target.closest("a")) state.chooseCell(Number(row.dataset.row));
    });
  }
  state.on("chosen", chosen);
  state.on("ranges", () => rows.forEach((row) => (row.hidden = state.lines.within[Number(row.dataset.row)] !== 1)));
  chosen();
}

/** Headers of a table become buttons that sort it, the least first, and then the greatest. */
function showSorted(id) {
  const {tHead, tBodies: [body]} = byId(id);
  const heads = [...tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const text = head.textContent;
    const button = made("button", {type: "button", class: "sort", text});
    button.addEventListener("click", () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      const sign = descending ? -1 : 1;
      const keyed = [...body.rows].map((row) => [row.cells[column].textContent, row]);
      keyed.sort(([a], [b]) => sign * compared(a, b));
      body.append(...keyed.map(([, row]) => row));
    });
    head.replaceChildren(button);
  });
}

/** Numbers by their values, before texts; texts as people sort them. */
function compared(a, b) {
  const [x, y] = [a, b].map((text) => (text.trim() === "" ? NaN : Number.parseFloat(text)));
  if (Number.isNaN(x) && Number.isNaN(y)) return a.localeCompare(b, "en", {numeric: true});
  if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
  return x - y;
}

/** The cell that the address names, if the page has it. */
function cellFromAddress(state) {
  const asked = decodeURIComponent(window.location.hash.replace(/^#cell=/, ""));
  const cell = state.cells.findIndex(({name}) => name === asked);
  if (cell >= 0) state.chooseCell(cell);
}

async function begin() {
  const [data, array] = await opened();
  const state = new StudyState(data, array);
  document.body.classList.add("live");
  showTip(state);
  showFactors(state);
  const lines = new ParallelView(state.lines);
  lines.canvas.setAttribute("aria-label", "Cells as lines from their levels to what they found. Drag along an axis to keep a range.");
  lines.canvas.style.minWidth = `${6 * state.lines.objectives.length}rem`;
  byId("lines").prepend(made("div", {class: "scroll views single"}, lines.canvas));
  const course = ["Course", [new CourseView(state, data, array)], "single"];
  showViews(state, [...viewsOf(state), course], () => state.lines.objectives.forEach((_, k) => state.lines.keep(k, null)));
  state.views.push(lines);
  cellFromAddress(state);
  showCell(state);
  showTable(state);
  for (const id of ["cells", "levels"]) showSorted(id);
  showTheme(state);
  window.addEventListener("hashchange", () => cellFromAddress(state));
  window.trajevo = {state};
}

begin();
