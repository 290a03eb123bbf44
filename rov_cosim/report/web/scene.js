// The moving picture: vehicle, thrusters with their forces, arm, structure, umbilical, current, set-point. SI, z up.
import {
  AmbientLight,
  ArrowHelper,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  EdgesGeometry,
  Fog,
  GridHelper,
  Group,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  MeshLambertMaterial,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Vehicle, X, arrow, bar, vector } from "./vehicle.js";

const TRAIL = 600;
const DRIFT = 70;

export class Picture {
  /** Draw into an element; throws where there is no WebGL. */
  constructor(element) {
    this.element = element;
    const quick = isQuick();
    this.renderer = new WebGLRenderer({ antialias: quick, powerPreference: "low-power" });
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    element.append(this.canvas);
    this.fineness = this.finest = quick ? 1 : 2;
    this.scene = new Scene();
    this.scene.fog = new Fog(0, 4, 14);
    this.camera = new PerspectiveCamera(38, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    Object.assign(this.controls, { enablePan: false, maxPolarAngle: 1.75, minDistance: 0.6, maxDistance: 14 });
    this.controls.addEventListener("change", () => this.render());
    this.scene.add(new HemisphereLight(0xffffff, 0x6d8797, 1.7), new AmbientLight(0xffffff, 0.35));
    const sun = new DirectionalLight(0xffffff, 2.0);
    sun.position.set(-2, -3, 5);
    this.scene.add(sun);
    this.canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#resize()).observe(element);
    this.#resize();
  }

  /** Build what a vehicle looks like; `of` gives the start value of `element.variable`. */
  build(of) {
    this.of = of;
    this.world?.traverse(({ geometry, material }) => [geometry, material].forEach((one) => one?.dispose()));
    this.world?.removeFromParent();
    this.world = new Group();
    this.scene.add(this.world);
    const style = getComputedStyle(this.element);
    const colour = (name) => new Color(style.getPropertyValue(name).trim());
    this.colours = Object.fromEntries(
      ["water", "frame", "float", "arm", "steel", "thrust", "pull", "buoyancy", "ghost", "drift", "rule"].map((name) => [
        name,
        colour(`--scene-${name}`),
      ]),
    );
    this.scene.background = this.colours.water;
    this.scene.fog.color = this.colours.water;
    this.vehicle = new Vehicle(of, this.colours);
    this.pull = arrow(this.colours.pull);
    this.buoyancy = arrow(this.colours.buoyancy);
    this.world.add(this.vehicle.body, this.pull, this.buoyancy);
    this.#ghost();
    this.#structure();
    this.#lines();
    this.#camera();
  }

  #ghost() {
    const { size, unit } = this.vehicle;
    const edges = new EdgesGeometry(new BoxGeometry(size.x, size.y, size.z));
    this.ghost = new Group();
    const lines = new LineSegments(edges, new LineDashedMaterial({ color: this.colours.ghost, dashSize: 0.04, gapSize: 0.03 }));
    lines.computeLineDistances();
    const nose = new ArrowHelper(X, new Vector3(size.x / 2, 0, 0), 0.2 * unit, this.colours.ghost, 0.06, 0.04);
    this.ghost.add(lines, nose);
    this.world.add(this.ghost);
  }

  #structure() {
    const at = vector(this.of, "passive_arm.attachment");
    const away = new Vector3(at.x, at.y, 0).normalize();
    const radius = 0.22;
    const centre = at.clone().addScaledVector(away, radius + 0.01);
    const steel = new MeshLambertMaterial({ color: this.colours.steel });
    const leg = (x, y) => bar(new Vector3(x, y, -3), new Vector3(x, y, 4), radius, steel);
    const side = new Vector3(-away.y, away.x, 0).multiplyScalar(2.6).addScaledVector(away, 0.5).add(centre);
    this.world.add(leg(centre.x, centre.y), leg(side.x, side.y));
    for (const z of [-1.1, 1.5]) {
      const [from, to] = [centre.clone().setZ(z), side.clone().setZ(z)];
      this.world.add(bar(from, to, 0.1, steel), bar(from, to.clone().setZ(z + 2.6), 0.07, steel));
    }
    const floor = new GridHelper(24, 48, this.colours.rule, this.colours.rule).rotateX(Math.PI / 2);
    floor.position.z = -1.6 * Math.max(1, this.vehicle.unit * 0.8);
    floor.material.transparent = true;
    floor.material.opacity = 0.5;
    this.world.add(floor);
  }

  #lines() {
    const line = (count, colour, Kind = Line, opacity = 1) => {
      const shape = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
      const made = new Kind(shape, new LineBasicMaterial({ color: colour, transparent: opacity < 1, opacity }));
      made.frustumCulled = false;
      this.world.add(made);
      return made;
    };
    this.trail = line(TRAIL, this.colours.ghost);
    this.umbilical = line(40, this.colours.pull);
    this.drift = line(2 * DRIFT, this.colours.drift, LineSegments, 0.8);
    let seed = 1;
    const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
    this.drops = Array.from({ length: DRIFT }, () => new Vector3(random(), random(), random()));
  }

  #camera() {
    const far = 1.9 + 1.1 * this.vehicle.size.x;
    this.controls.target.set(0.3 * this.vehicle.size.x, 0.15, 0.15);
    const narrow = Math.max(1, 1.25 / this.camera.aspect);
    this.camera.position.set(0.5, -1.1, 0.4).multiplyScalar(far * narrow).add(this.controls.target);
    this.controls.update();
  }

  /** Show one row of a motion: `at(name)` gives a variable's value, or undefined; `trail(k)` a past place. */
  show(at, time, trail) {
    this.now = [at, time, trail];
    const pose = (name) => ["x", "y", "z", "phi", "theta", "psi"].map((axis) => at(`${name}.${axis}`) ?? 0);
    place(this.vehicle.body, pose("rov_plant.eta"));
    place(this.ghost, pose("scenario.eta_d"));
    this.vehicle.show(at);
    this.#forces(at);
    this.#umbilical();
    this.#current(at, time);
    this.#trail(trail);
    this.render();
  }

  #forces(at) {
    const { heaviest, length } = this.vehicle;
    const pull = vector(this.of, "rov_plant.F_C").add(vector((name) => at(name), "scenario.F_umbilical"));
    const lift = new Vector3(0, 0, this.of("rov_plant.dB") ?? 0);
    for (const [arrow, force, point] of [
      [this.pull, pull, "r_C"],
      [this.buoyancy, lift, "r_B"],
    ]) {
      const size = force.length();
      arrow.visible = size > 0.002 * heaviest;
      arrow.position.copy(vector(this.of, `rov_plant.${point}`).applyMatrix4(this.vehicle.body.matrixWorld));
      if (size) arrow.setDirection(force.normalize());
      arrow.setLength(Math.max(length(size), 1e-3), 0.07 * this.vehicle.unit, 0.045 * this.vehicle.unit);
    }
  }

  #umbilical() {
    const from = vector(this.of, "rov_plant.r_C").applyMatrix4(this.vehicle.body.matrixWorld);
    const to = new Vector3(-1.6, -0.4, 4.5);
    const bend = new Vector3(from.x - 0.7 * this.vehicle.unit, from.y, from.z + 0.5 * this.vehicle.unit);
    const points = this.umbilical.geometry.attributes.position;
    for (let i = 0; i < points.count; i++) {
      const s = i / (points.count - 1);
      const p = ["x", "y", "z"].map((a) => (1 - s) ** 2 * from[a] + 2 * s * (1 - s) * bend[a] + s * s * to[a]);
      points.setXYZ(i, ...p);
    }
    points.needsUpdate = true;
  }

  #current(at, time) {
    const flow = vector((name) => at(name), "scenario.current");
    this.drift.visible = flow.length() > 1e-4;
    if (!this.drift.visible) return;
    const box = [7, 7, 3.4];
    const points = this.drift.geometry.attributes.position;
    this.drops.forEach((drop, k) => {
      const p = ["x", "y", "z"].map((axis, i) => {
        const moved = drop[axis] + (flow[axis] * time) / box[i];
        return (moved - Math.floor(moved) - 0.5) * box[i];
      });
      points.setXYZ(2 * k, ...p);
      points.setXYZ(2 * k + 1, p[0] - flow.x * 0.9, p[1] - flow.y * 0.9, p[2] - flow.z * 0.9);
    });
    points.needsUpdate = true;
  }

  #trail(trail) {
    const points = this.trail.geometry.attributes.position;
    for (let k = 0; k < TRAIL; k++) points.setXYZ(k, ...trail(k / (TRAIL - 1)));
    points.needsUpdate = true;
  }

  #key(event) {
    const turn = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    const zoom = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 }[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    const arm = this.camera.position.clone().sub(this.controls.target);
    if (zoom) arm.multiplyScalar(zoom);
    if (turn) {
      arm.applyAxisAngle(new Vector3(0, 0, 1), turn[0]);
      const side = new Vector3(-arm.y, arm.x, 0).normalize();
      arm.applyAxisAngle(side, turn[1]);
    }
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
    this.render();
  }

  #resize() {
    const { clientWidth, clientHeight } = this.element;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(Math.min(devicePixelRatio, 2) * this.fineness, 2));
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.now) this.render();
  }

  /** Draw a pixel of the screen by one while it plays, and as fine as can be when it stands. */
  play(on) {
    this.fineness = on ? 1 : this.finest;
    this.#resize();
  }

  /** Draw fewer pixels, where frames take long. */
  coarser() {
    this.fineness = Math.max(0.7 * this.fineness, 0.4);
    this.#resize();
  }

  /** Take the colours of the page again. */
  recolour() {
    if (!this.of) return;
    const [place, target] = [this.camera.position.clone(), this.controls.target.clone()];
    this.build(this.of);
    this.camera.position.copy(place);
    this.controls.target.copy(target);
    this.controls.update();
    if (this.now) this.show(...this.now);
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}

/** Tell whether there is a GPU: without one, smooth edges take as long as all else, and are for a picture that stands. */
function isQuick() {
  const context = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context !== null;
}

function place(object, [x, y, z, phi, theta, psi]) {
  object.position.set(x, y, z);
  object.rotation.set(phi, theta, psi, "ZYX");
  object.updateMatrixWorld(true);
}
