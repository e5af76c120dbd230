"use strict";
// The robot in space: its joints are moved here, so that every instant of every motion can be shown.

const LINK_COLOUR = [0.78, 0.8, 0.83];
const STEPS_OF_PATH = 160;

/** Poses of all joints at positions of the actuators. */
class Chain {
  constructor(three, arm, motions) {
    Object.assign(this, {three, arm, motions});
    this.places = arm.places.map((values) => new three.Matrix4().fromArray(values));
    this.axes = arm.axes.map((values) => new three.Vector3(...values));
    this.tool = new three.Matrix4().fromArray(arm.tool.place);
    this.frames = arm.places.map(() => new three.Matrix4());
    this.own = new three.Matrix4();
    this.root = new three.Matrix4();
    this.atTool = new three.Matrix4();
  }

  /** Positions of the model's joints at an instant. */
  positions(row, time) {
    if (this.motions.model) return this.motions.modelAt(row, time);
    const q = this.motions.values(row, time, 0);
    const {leads} = this.arm;
    if (!leads) return q;
    return leads.map((line) => line.reduce((sum, share, k) => sum + share * (k < q.length ? q[k] : 1), 0));
  }

  /** Set the frames of the base, of all joints, and that of the tool. */
  move(row, time) {
    if (this.motions.bases) this.root.fromArray(this.motions.bases, 16 * row);
    const q = this.positions(row, time);
    const {parents, columns, turns, tool} = this.arm;
    for (let k = 0; k < parents.length; k += 1) {
      const value = q[columns[k]];
      if (turns[k]) this.own.makeRotationAxis(this.axes[k], value);
      else this.own.makeTranslation(...this.axes[k].clone().multiplyScalar(value).toArray());
      this.frames[k].multiplyMatrices(this.places[k], this.own);
      this.frames[k].premultiply(parents[k] ? this.frames[parents[k] - 1] : this.root);
    }
    this.atTool.copy(tool.joint ? this.frames[tool.joint - 1] : this.root).multiply(this.tool);
  }

  /** Where the tool is at even instants of a motion. */
  path(row, steps = STEPS_OF_PATH) {
    const duration = this.motions.duration(row);
    return Array.from({length: steps + 1}, (_, k) => {
      this.move(row, (duration * k) / steps);
      return new this.three.Vector3().setFromMatrixPosition(this.atTool);
    });
  }
}

class ArmView {
  constructor(state, host, array) {
    const three = MeshCat.THREE;
    const {arm} = state.data;
    Object.assign(this, {state, host, three, arm});
    this.renderer = new three.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${state.data.robot} along the chosen motion. Drag to turn, wheel to zoom.`);
    host.append(this.canvas);
    this.chain = new Chain(three, arm, state.motions);
    this.scene = new three.Scene();
    this.camera = new three.PerspectiveCamera(40, 1, 0.01 * arm.extent, 60 * arm.extent);
    this.world = new three.Group();
    this.scene.add(this.world);
    this.draw = onceAFrame(() => this.drawNow());
    this.light();
    this.stand();
    this.addSurfaces(array);
    if (arm.sticks) this.addSticks();
    this.lines = [];
    this.watch();
    this.look();
    new ResizeObserver(() => this.fit()).observe(host);
    state.on("time", this.draw);
    for (const event of ["chosen", "pins", "theme"]) state.on(event, () => this.renewPaths());
    this.renewPaths();
    this.fit();
  }

  light() {
    const {three, scene} = this;
    scene.add(new three.HemisphereLight(0xffffff, 0x707782, 0.55));
    const sun = new three.DirectionalLight(0xffffff, 0.5);
    sun.position.set(2, 4, 3);
    scene.add(sun);
    const fill = new three.DirectionalLight(0xffffff, 0.15);
    fill.position.set(-3, 2, -2);
    scene.add(fill);
  }

  /** Up is against gravity, and there is a floor at the height of the base. */
  stand() {
    const {three, arm} = this;
    const down = new three.Vector3(...arm.gravity);
    const up = down.lengthSq() > 0 ? down.negate().normalize() : new three.Vector3(0, 0, 1);
    this.world.quaternion.setFromUnitVectors(up, new three.Vector3(0, 1, 0));
    this.grid = new three.GridHelper(4 * arm.extent, 20, 0x9aa3ad, 0xc3c8cf);
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.5;
    this.scene.add(this.grid);
    this.target = new three.Vector3(...arm.middle).applyQuaternion(this.world.quaternion);
    this.frames = [new three.Group(), ...arm.parents.map(() => new three.Group())];
    for (const frame of this.frames) {
      frame.matrixAutoUpdate = false;
      this.world.add(frame);
    }
    this.frames[0].add(this.axesOf(0.1));
    this.tool = this.axesOf(0.08);
    this.tool.matrixAutoUpdate = false;
    this.world.add(this.tool);
  }

  axesOf(share) {
    const size = share * this.arm.extent;
    return new this.three.AxesHelper(size);
  }

  mesh(array, {vertices, triangles, colour}, opacity = 1) {
    const {three} = this;
    let geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(array(vertices), 3));
    if (triangles) geometry.setIndex(new three.BufferAttribute(array(triangles), 1));
    geometry = geometry.index ? geometry.toNonIndexed() : geometry;
    geometry.computeVertexNormals();
    const material = new three.MeshLambertMaterial({
      color: new three.Color(...colour),
      opacity,
      transparent: opacity < 1,
      side: three.DoubleSide,
    });
    return new three.Mesh(geometry, material);
  }

  addSurfaces(array) {
    this.moving = [];
    for (const surface of this.arm.surfaces) {
      const plain = surface.kind === "link" && surface.colour.every((value) => value > 0.85);
      const opacity = {obstacle: 0.65, attached: 0.85, plane: 0.35}[surface.kind] || 1;
      const mesh = this.mesh(array, plain ? {...surface, colour: LINK_COLOUR} : surface, opacity);
      mesh.name = surface.kind;
      if (surface.poses) {
        mesh.matrixAutoUpdate = false;
        this.moving.push({mesh, times: array(surface.times), poses: array(surface.poses)});
        this.world.add(mesh);
      } else {
        (surface.joint === null ? this.world : this.frames[surface.joint]).add(mesh);
      }
    }
    this.loads = this.arm.loads.map((load) => {
      const mesh = this.mesh(array, {...load, triangles: null});
      mesh.matrixAutoUpdate = false;
      this.world.add(mesh);
      return {...load, mesh};
    });
  }

  /** Links as cylinders from joint to joint, for a robot without shapes. */
  addSticks() {
    const {three, arm} = this;
    const size = 0.014 * arm.extent;
    const rod = new three.CylinderGeometry(size, size, 1, 20);
    const material = new three.MeshLambertMaterial({color: new three.Color(...LINK_COLOUR)});
    this.sticks = Array.from({length: arm.parents.length + 1}, () => {
      const mesh = new three.Mesh(rod, material);
      this.world.add(mesh);
      return mesh;
    });
    arm.axes.forEach((axis, k) => {
      const turns = arm.turns[k];
      const shape = turns
        ? new three.CylinderGeometry(2 * size, 2 * size, 5 * size, 24)
        : new three.BoxGeometry(3 * size, 6 * size, 3 * size);
      const mesh = new three.Mesh(shape, new three.MeshLambertMaterial({color: turns ? 0x0072b2 : 0xd55e00}));
      mesh.quaternion.setFromUnitVectors(new three.Vector3(0, 1, 0), new three.Vector3(...axis));
      this.frames[k + 1].add(mesh);
    });
  }

  /** Paths of the tool of the chosen and the pinned motions, and their via points. */
  renewPaths() {
    const {three, state} = this;
    for (const line of this.lines) {
      this.world.remove(line);
      line.geometry.dispose();
    }
    const rows = [state.chosen, ...state.pins.filter((pin) => pin !== state.chosen)];
    this.lines = rows.map((row, k) => {
      const geometry = new three.BufferGeometry().setFromPoints(this.chain.path(row));
      const material = new three.LineBasicMaterial({color: new three.Color(themed(k ? "second" : "accent"))});
      return new three.Line(geometry, material);
    });
    if (state.motions.via) {
      const [, count] = state.motions.via.shape;
      const places = Array.from({length: count}, (_, k) => {
        this.chain.move(state.chosen, state.motions.via[state.chosen * count + k]);
        return new three.Vector3().setFromMatrixPosition(this.chain.atTool);
      });
      const material = new three.PointsMaterial({
        color: new three.Color(themed("accent")),
        size: 8,
        sizeAttenuation: false,
      });
      this.lines.push(new three.Points(new three.BufferGeometry().setFromPoints(places), material));
    }
    this.world.add(...this.lines);
    this.draw();
  }

  /** Turn, tilt and distance of the camera by pointers, wheel and keys. */
  watch() {
    [this.turn, this.tilt, this.far] = [0.75, 0.38, 1.45 * this.arm.extent];
    const held = new Map();
    const {canvas} = this;
    canvas.tabIndex = 0;
    canvas.style.touchAction = "none";
    canvas.addEventListener("pointerdown", (event) => {
      held.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held.has(event.pointerId)) return;
      const before = held.get(event.pointerId);
      const apart = () => {
        const [a, b] = [...held.values()];
        return Math.hypot(a[0] - b[0], a[1] - b[1]);
      };
      const wide = held.size === 2 ? apart() : 0;
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (held.size === 2) this.zoom(wide / Math.max(apart(), 1));
      else this.orbit(event.clientX - before[0], event.clientY - before[1], event.shiftKey || event.buttons === 2);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => held.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.zoom(Math.exp(0.001 * event.deltaY));
      },
      {passive: false},
    );
    canvas.addEventListener("keydown", (event) => {
      const by = {ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20]}[event.key];
      if (by) this.orbit(...by, false);
      else if (event.key === "+") this.zoom(0.9);
      else if (event.key === "-") this.zoom(1.1);
      else return;
      event.preventDefault();
    });
  }

  orbit(x, y, shift) {
    if (shift) {
      const size = (this.far / this.host.clientHeight) * 0.75;
      const right = new this.three.Vector3().setFromMatrixColumn(this.camera.matrix, 0);
      const up = new this.three.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
      this.target.addScaledVector(right, -size * x).addScaledVector(up, size * y);
    } else {
      this.turn -= 0.008 * x;
      this.tilt = Math.min(Math.max(this.tilt + 0.008 * y, -1.5), 1.5);
    }
    this.look();
  }

  zoom(factor) {
    this.far = Math.min(Math.max(this.far * factor, 0.2 * this.arm.extent), 20 * this.arm.extent);
    this.look();
  }

  look() {
    const {target, turn, tilt, far} = this;
    const flat = Math.cos(tilt);
    this.camera.position.set(
      target.x + far * flat * Math.sin(turn),
      target.y + far * Math.sin(tilt),
      target.z + far * flat * Math.cos(turn),
    );
    this.camera.lookAt(target);
    this.draw();
  }

  fit() {
    const {clientWidth: width, clientHeight: height} = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = width < height ? 55 : 40;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  drawNow() {
    const {state, chain} = this;
    chain.move(state.chosen, state.time);
    this.frames[0].matrix.copy(chain.root);
    chain.frames.forEach((matrix, k) => this.frames[k + 1].matrix.copy(matrix));
    this.tool.matrix.copy(chain.atTool);
    if (this.sticks) this.placeSticks();
    for (const {mesh, times, poses} of this.moving) {
      const last = times.length - 1;
      const k = Math.round((state.time / times[last]) * last);
      mesh.matrix.fromArray(poses.subarray(16 * k, 16 * k + 16)).transpose();
    }
    for (const load of this.loads) {
      chain.move(state.chosen, this.heldAt(load));
      load.mesh.matrix.copy(chain.atTool);
    }
    this.world.updateMatrixWorld(true);
    this.renderer.render(this.scene, this.camera);
  }

  /** The instant whose pose of the tool a load has: it stands where it is picked up, and where it is put down. */
  heldAt({from, to}) {
    const {time, chosen, motions} = this.state;
    if (from === null) return time;
    const [picked, placed] = [motions.breakAt(chosen, from), motions.breakAt(chosen, to)];
    if (picked < placed) return Math.min(Math.max(time, picked), placed);
    return time > placed && time < picked ? placed : time;
  }

  placeSticks() {
    const {three, chain, arm} = this;
    const at = (matrix) => new three.Vector3().setFromMatrixPosition(matrix);
    const base = at(chain.root);
    const ends = arm.parents.map((parent, k) => [parent ? at(chain.frames[parent - 1]) : base, at(chain.frames[k])]);
    ends.push([arm.tool.joint ? at(chain.frames[arm.tool.joint - 1]) : base, at(chain.atTool)]);
    ends.forEach(([begin, end], k) => {
      const span = end.clone().sub(begin);
      const length = span.length();
      this.sticks[k].visible = length > 1e-9;
      if (length <= 1e-9) return;
      this.sticks[k].position.copy(begin).addScaledVector(span, 0.5);
      this.sticks[k].quaternion.setFromUnitVectors(new three.Vector3(0, 1, 0), span.divideScalar(length));
      this.sticks[k].scale.set(1, length, 1);
    });
  }
}
