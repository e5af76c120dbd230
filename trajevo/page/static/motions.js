"use strict";
// Motions of all solutions: piecewise polynomials, and efforts at nodes of every segment.

const QUANTITIES = ["position", "velocity", "acceleration", "jerk"];

class Motions {
  constructor(data, array) {
    const {members} = data;
    this.breaks = array(members.breaks);
    this.coefficients = array(members.coefficients);
    [this.count, this.segments, this.joints, this.terms] = this.coefficients.shape;
    this.via = members.via && array(members.via);
    this.effort = members.effort && array(members.effort);
    this.effortAt = members.effort_at;
    this.effortScale = members.effort_scale;
    this.bases = members.bases && array(members.bases);
    this.model = members.model && array(members.model);
    this.modelScale = members.model_scale;
    this.factorials = [0, 1, 2, 3].map((order) =>
      Array.from({length: this.terms}, (_, power) => {
        let factor = 1;
        for (let k = 0; k < order; k += 1) factor *= power - k;
        return factor;
      }),
    );
  }

  duration(row) {
    return this.breaks[row * (this.segments + 1) + this.segments];
  }

  /** Instant at which a segment begins, or the last one ends. */
  breakAt(row, segment) {
    return this.breaks[row * (this.segments + 1) + segment];
  }

  segmentAt(row, time) {
    let low = 0;
    let high = this.segments - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.breakAt(row, middle) <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** A derivative of all joints at an instant of a segment. */
  valuesIn(row, segment, time, order, into = new Float64Array(this.joints)) {
    const local = time - this.breakAt(row, segment);
    const factors = this.factorials[order];
    let place = (row * this.segments + segment) * this.joints * this.terms;
    for (let joint = 0; joint < this.joints; joint += 1, place += this.terms) {
      let value = 0;
      for (let power = this.terms - 1; power >= order; power -= 1) {
        value = value * local + factors[power] * this.coefficients[place + power];
      }
      into[joint] = value;
    }
    return into;
  }

  values(row, time, order, into) {
    const within = Math.min(Math.max(time, 0), this.duration(row));
    return this.valuesIn(row, this.segmentAt(row, within), within, order, into);
  }

  /** Curves of a quantity: instants, and values of every joint; a jump stands upright. */
  curves(row, name, count = 240) {
    const order = QUANTITIES.indexOf(name);
    return order < 0 ? this.effortCurves(row, name) : this.derivativeCurves(row, order, count);
  }

  derivativeCurves(row, order, count) {
    const t = [];
    const y = Array.from({length: this.joints}, () => []);
    const duration = this.duration(row);
    const values = new Float64Array(this.joints);
    for (let segment = 0; segment < this.segments; segment += 1) {
      const begin = this.breakAt(row, segment);
      const span = this.breakAt(row, segment + 1) - begin;
      const steps = Math.max(4, Math.round((count * span) / duration));
      for (let k = 0; k <= steps; k += 1) {
        const at = begin + (span * k) / steps;
        this.valuesIn(row, segment, at, order, values);
        t.push(at);
        for (let joint = 0; joint < this.joints; joint += 1) y[joint].push(values[joint]);
      }
    }
    return {t, y};
  }

  /** Efforts, or the powers that they and the velocities make. */
  effortCurves(row, name) {
    const each = this.effortAt.length;
    const nodes = each * this.segments;
    const t = [];
    const y = Array.from({length: this.joints}, () => []);
    for (let k = 0; k < nodes; k += 1) {
      const segment = Math.floor(k / each);
      const begin = this.breakAt(row, segment);
      const at = begin + this.effortAt[k % each] * (this.breakAt(row, segment + 1) - begin);
      const velocity = name === "power" ? this.valuesIn(row, segment, at, 1) : null;
      t.push(at);
      for (let joint = 0; joint < this.joints; joint += 1) {
        const effort = this.effort[(row * nodes + k) * this.joints + joint] * this.effortScale[joint];
        y[joint].push(velocity ? effort * velocity[joint] : effort);
      }
    }
    return {t, y};
  }

  /** Positions of the model's joints, for a robot whose actuators do not drive them one by one. */
  modelAt(row, time) {
    const [, places, joints] = this.model.shape;
    const share = (Math.min(Math.max(time / this.duration(row), 0), 1)) * (places - 1);
    const first = Math.min(Math.floor(share), places - 2);
    const rest = share - first;
    const place = (row * places + first) * joints;
    return Float64Array.from({length: joints}, (_, joint) =>
      this.modelScale[joint] *
        ((1 - rest) * this.model[place + joint] + rest * this.model[place + joints + joint]),
    );
  }
}

/** The value of a curve at an instant, between its points. */
function valueAt(curve, joint, time) {
  const {t} = curve;
  let low = 0;
  let high = t.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= time) low = middle;
    else high = middle;
  }
  const span = t[high] - t[low];
  const share = span > 0 ? Math.min(Math.max((time - t[low]) / span, 0), 1) : 0;
  return curve.y[joint][low] * (1 - share) + curve.y[joint][high] * share;
}
