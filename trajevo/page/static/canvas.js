"use strict";
// Drawing on canvases: sizes, colours, axes. Everything that is drawn often is kept in a layer of its own.

const SERIES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f6a00", "#888888"];
const SERIES_DARK = ["#4aa8e0", "#f0884a", "#2fc79b", "#e39ac5", "#f0b93a", "#8fd0f7", "#c9b458", "#aaaaaa"];
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]];

function isDark() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : window.matchMedia("(prefers-color-scheme: dark)").matches;
}

function seriesColour(k) {
  return (isDark() ? SERIES_DARK : SERIES)[k % SERIES.length];
}

/** Lines beyond the eighth colour differ by their dashes. */
function seriesDash(k) {
  return DASHES[Math.floor(k / SERIES.length) % DASHES.length];
}

function themed(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** A canvas that is as sharp as the screen, with its size in CSS pixels; nothing where it is not shown. */
function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (!width || !height) return null;
  const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== across || canvas.height !== down) Object.assign(canvas, {width: across, height: down});
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return {context, width, height, ratio};
}

/** A canvas of the same size that is not shown, on which a layer is kept. */
function layerOf({width, height, ratio}) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return {canvas, context};
}

/** Draw what a view keeps as a layer; the layer is made again where there is none, or the size is another one. */
function drawLayer(view, sheet) {
  if (!view.layer || view.layer.width !== sheet.width || view.layer.height !== sheet.height) {
    const {canvas, context} = layerOf(sheet);
    view.place(sheet);
    view.drawAll(context);
    view.layer = {canvas, width: sheet.width, height: sheet.height};
  }
  sheet.context.drawImage(view.layer.canvas, 0, 0, sheet.width, sheet.height);
}

/** A linear map of an axis, with some room at both ends. */
function scale(low, high, from, to, room = 0.04) {
  let [first, last] = [low, high];
  if (!(last > first)) {
    const half = Math.abs(first) * 0.05 || 1;
    [first, last] = [first - half, last + half];
  }
  const spare = room * (last - first);
  [first, last] = [first - spare, last + spare];
  return {
    low: first,
    high: last,
    from,
    to,
    at: (value) => from + ((value - first) / (last - first)) * (to - from),
    value: (place) => first + ((place - from) / (to - from)) * (last - first),
  };
}

/** Axes at the left and below, with a grid and labels. */
function drawAxes(context, box, x, y, labels) {
  context.font = `12px ${themed("font")}`;
  context.lineWidth = 1;
  context.strokeStyle = themed("grid");
  context.fillStyle = themed("muted");
  const across = ticks(x.low, x.high, Math.max(2, (box.right - box.left) / 90));
  const down = ticks(y.low, y.high, Math.max(2, (box.bottom - box.top) / 45));
  context.beginPath();
  for (const value of across) {
    context.moveTo(x.at(value), box.top);
    context.lineTo(x.at(value), box.bottom);
  }
  for (const value of down) {
    context.moveTo(box.left, y.at(value));
    context.lineTo(box.right, y.at(value));
  }
  context.stroke();
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const value of across) context.fillText(shown(value), x.at(value), box.bottom + 4);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of down) context.fillText(shown(value), box.left - 5, y.at(value));
  context.fillStyle = themed("text");
  if (labels.x) {
    context.textAlign = "right";
    context.textBaseline = "bottom";
    context.fillText(labels.x, box.right, box.bottom + 33);
  }
  context.textAlign = "left";
  context.textBaseline = "bottom";
  context.fillText(labels.y, 4, box.top - 5);
}

/** A mark of a chosen, pinned or hovered solution, or of one that belongs to such a cell of a study. */
function drawMark(context, kind, x, y) {
  if (kind.startsWith("of ")) {
    context.fillStyle = themed({"of chosen": "accent", "of pin": "second"}[kind] || "text");
    context.fillRect(x - 2.5, y - 2.5, 5, 5);
    return;
  }
  context.lineWidth = 2;
  context.beginPath();
  if (kind === "pin") {
    context.moveTo(x, y - 7);
    context.lineTo(x + 7, y);
    context.lineTo(x, y + 7);
    context.lineTo(x - 7, y);
    context.closePath();
  } else {
    context.arc(x, y, kind === "chosen" ? 7 : 5, 0, 2 * Math.PI);
  }
  context.fillStyle = kind === "chosen" ? themed("accent") : kind === "pin" ? themed("second") : "transparent";
  context.strokeStyle = kind === "hover" ? themed("text") : themed("panel");
  context.fill();
  context.stroke();
}

/** A call that is made once per frame, however often it is asked for. */
function onceAFrame(call) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      call();
    });
  };
}

/** Where a pointer is on an element, in CSS pixels. */
function placeOf(event, element) {
  const box = element.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}
