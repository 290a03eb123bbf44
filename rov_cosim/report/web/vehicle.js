// What a vehicle looks like, with its thrusters and its arm, made of the parameters of its system. SI, body axes.
import {
  ArrowHelper,
  BoxGeometry,
  CylinderGeometry,
  Group,
  Mesh,
  MeshLambertMaterial,
  SphereGeometry,
  TorusGeometry,
  Vector3,
} from "three";

const THRUSTERS = [1, 2, 3, 4, 5, 6, 7, 8];

export const X = new Vector3(1, 0, 0);

export const vector = (of, name) => new Vector3(...["x", "y", "z"].map((axis) => of(`${name}.${axis}`) ?? 0));

export const arrow = (colour) => new ArrowHelper(X, new Vector3(), 0.1, colour);

/** Return a cylinder from the origin along x. */
function rod(length, radius, material, far = radius) {
  const shape = new CylinderGeometry(far, radius, length, 20).rotateZ(-Math.PI / 2).translate(length / 2, 0, 0);
  return new Mesh(shape, material);
}

export function bar(from, to, radius, material) {
  const made = rod(from.distanceTo(to), radius, material);
  made.position.copy(from);
  made.quaternion.setFromUnitVectors(X, to.clone().sub(from).normalize());
  return made;
}

export class Vehicle {
  /** `of` gives the start value of `element.variable`; `colours` are those of the picture by name. */
  constructor(of, colours) {
    Object.assign(this, { of, colours, body: new Group() });
    this.places = THRUSTERS.map((i) => vector(of, `rov_plant.thruster[${i}].r`));
    const reach = (axis) => Math.max(...this.places.map((r) => Math.abs(r[axis])));
    this.size = new Vector3(2 * reach("x"), 2 * reach("y"), 0).multiplyScalar(1.02);
    this.size.z = Math.max(2 * Math.abs(of("rov_plant.r_C.z") ?? 0), 0.45 * this.size.x);
    this.unit = this.size.x / 0.8; // of what is drawn as large as the vehicle is
    this.heaviest = ((of("rov_plant.mass") ?? 80) / 80) * 40; // force in N whose arrow is about as long as the vehicle
    this.length = (force) => (0.9 * this.unit * Math.abs(force)) / this.heaviest;
    this.#frame();
    this.#arm();
  }

  /** Show forces and joints: `at(name)` gives a variable's value, or undefined. */
  show(at) {
    this.thrusters.forEach(({ force, duct }, k) => {
      const loss = at(`scenario.thrust_loss[${k + 1}]`) ?? 0;
      const thrust = (at(`controller.u[${k + 1}]`) ?? 0) * (1 - loss);
      force.visible = Math.abs(thrust) > 0.002 * this.heaviest;
      force.setDirection(thrust < 0 ? new Vector3(-1, 0, 0) : X);
      force.setLength(Math.max(this.length(thrust), 1e-3), 0.05 * this.unit, 0.035 * this.unit);
      duct.scale.setScalar(loss ? 0.55 : 1);
    });
    const q = [1, 2, 3, 4, 5, 6].map((i) => at(`passive_arm.q[${i}]`) ?? 0);
    const [yaw, shoulder, elbow, wrist] = this.joints;
    yaw.visible = at("passive_arm.q[1]") !== undefined;
    yaw.rotation.z = q[0];
    shoulder.rotation.y = q[1];
    elbow.rotation.y = q[2];
    wrist.rotation.set(q[5], q[4], q[3], "ZYX");
  }

  material(name) {
    return new MeshLambertMaterial({ color: this.colours[name] });
  }

  #frame() {
    const { x, y, z } = this.size;
    const frame = this.material("frame");
    const float = new Mesh(new BoxGeometry(x * 0.96, y * 0.92, z * 0.3), this.material("float"));
    float.position.z = z * 0.33;
    this.body.add(float);
    const corner = (i, j, k) => new Vector3((i * x) / 2, (j * y) / 2, (k * z) / 2);
    const radius = 0.014 * this.unit;
    for (const j of [-0.94, 0.94]) {
      for (const i of [-0.94, 0.94]) this.body.add(bar(corner(i, j, -1), corner(i, j, 0.5), radius, frame));
      this.body.add(bar(corner(-1.04, j, -1), corner(1.04, j, -1), radius * 1.5, frame));
    }
    for (const i of [-0.94, 0.94]) this.body.add(bar(corner(i, -0.94, -0.9), corner(i, 0.94, -0.9), radius, frame));
    const hull = rod(x * 0.7, z * 0.13, this.material("steel"));
    hull.position.set(-x * 0.35, 0, -z * 0.12);
    const eye = new Mesh(new SphereGeometry(z * 0.13, 24, 16), this.material("frame"));
    eye.position.set(x * 0.35, 0, -z * 0.12);
    this.body.add(hull, eye);
    this.thrusters = THRUSTERS.map((i, k) => {
      const d = vector(this.of, `rov_plant.thruster[${i}].d`);
      const enabled = this.of(`rov_plant.thruster[${i}].enabled`) !== 0 && d.length() > 0;
      const holder = new Group();
      holder.visible = enabled;
      holder.position.copy(this.places[k]);
      holder.quaternion.setFromUnitVectors(X, d.length() ? d.clone().normalize() : X);
      const ring = 0.052 * this.unit;
      const duct = new Mesh(new TorusGeometry(ring, ring * 0.28, 10, 28).rotateY(Math.PI / 2), frame);
      const hub = rod(ring * 1.3, ring * 0.34, this.material("steel"));
      hub.position.x = -ring * 0.65;
      const force = arrow(this.colours.thrust);
      holder.add(duct, hub, force);
      this.body.add(holder);
      return { force, duct };
    });
  }

  #arm() {
    const [first, second] = [1, 2].map((i) => this.of(`passive_arm.L[${i}]`) ?? 0.7);
    const steel = this.material("arm");
    const joint = () => new Mesh(new SphereGeometry(0.032, 20, 14), this.material("frame"));
    this.joints = [new Group(), new Group(), new Group(), new Group()];
    const [yaw, shoulder, elbow, wrist] = this.joints;
    yaw.position.copy(vector(this.of, "passive_arm.r_A"));
    elbow.position.x = first;
    wrist.position.x = second;
    yaw.add(shoulder, joint());
    shoulder.add(rod(first, 0.024, steel, 0.02), elbow);
    elbow.add(joint(), rod(second, 0.02, steel, 0.016), wrist);
    const magnet = new Mesh(new CylinderGeometry(0.05, 0.05, 0.03, 24).rotateZ(Math.PI / 2), this.material("steel"));
    wrist.add(joint(), magnet);
    this.body.add(yaw);
  }
}
