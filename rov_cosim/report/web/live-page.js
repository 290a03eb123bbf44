// The live part of the page: controls, runs of all chosen controllers, curves, table, picture, link and command.
import { AXES, errors, score, wrapped } from "./score.js";
import { Loops, command } from "./loops.js";
import { lyapunov } from "./lyapunov.js";
import { Panel } from "./panel.js";
import { Player } from "./player.js";
import { DOTTED, Plots, SOLID } from "./plots.js";
import { show as motion } from "./motion.js";

const REST = 80; // ms
const OLD = 300; // ms after which values of before are told apart from those that are new
const DEGREES = 180 / Math.PI;
const SCALE = { x: 1e3, y: 1e3, z: 1e3, psi: DEGREES };
const $ = (selector) => document.querySelector(selector);

export class LivePage {
  constructor(data, workerSource, picture) {
    this.data = data;
    this.picture = picture;
    this.loops = new Loops(data, workerSource);
    this.runs = new Map();
    this.asked = { number: 0 };
    this.plots = new Plots((time) => this.player.seek(time));
    this.player = new Player($(".player"), (time) => this.#show(time), picture);
    this.panel = new Panel($("#controls"), data, this.loops, () => this.change());
    $("#reset").addEventListener("click", () => this.panel.reset());
    $("#copy").addEventListener("click", () => copy($("#command").textContent, $("#copy")));
    $("#link").addEventListener("click", () => copy(location.href, $("#link")));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.picture?.recolour();
      this.#draw();
      this.#rest();
    });
    addEventListener("hashchange", () => this.panel.read(location.hash));
    this.panel.read(location.hash);
  }

  system(controller) {
    return this.data.systems[this.panel.vehicle][controller];
  }

  /**
   * Run again all that is shown, and show first what the picture is of.
   *
   * While a hand moves on, what it passed is shown as soon as it is there, but the other controllers wait until it rests.
   */
  async change() {
    const begun = performance.now();
    this.moved ??= begun;
    clearTimeout(this.later);
    const { shown, focus, vehicle } = this.panel;
    const first = shown.includes(focus) ? focus : shown[0];
    const asked = (this.asked = { number: this.asked.number + 1, vehicle, first });
    const found = new Map(this.of === vehicle ? this.runs : []);
    const after = [];
    for (const some of [[first], shown.filter((controller) => controller !== first)]) {
      const running = Promise.all(some.map((controller) => this.#run(controller, asked.number)));
      if (after.length) this.#lyapunov(this.focused); // a frame later than what a hand waits for, while the others run
      const runs = await running;
      if (runs.includes(null) || this.asked.vehicle !== vehicle || this.asked.first !== first) return;
      some.forEach((controller, i) => found.set(controller, runs[i]));
      this.of = vehicle;
      this.runs = new Map(shown.filter((name) => found.has(name)).map((name) => [name, found.get(name)]));
      if (some.length) this.#draw();
      await painted();
      if (this.asked !== asked) return this.#lyapunov(this.focused);
      after.push(performance.now() - begun);
    }
    this.moved = undefined;
    this.#address();
    this.#rest();
    const runs = [...this.runs.values()];
    const steps = runs.reduce((sum, run) => sum + Math.max(run.rows - 1, 0), 0);
    const [one, all] = after.map((time) => time.toFixed(0));
    $("#took").textContent =
      `${steps} steps in ${runs.length} ${runs.length > 1 ? "loops" : "loop"}: ` +
      (runs.length > 1 ? `the first on screen after ${one} ms, all after ${all} ms.` : `on screen after ${one} ms.`);
    [$("#live").dataset.took, $("#live").dataset.all] = after.map((time) => time.toFixed(1));
    $("#live").dataset.runs = Number($("#live").dataset.runs ?? 0) + 1;
  }

  /** Run a controller's system with what is chosen; null if it was asked again before it began. */
  async #run(controller, number) {
    const { controls, values, settings } = this.panel;
    const system = this.system(controller);
    const set = this.loops.set(system, controls, values);
    const run = await this.loops.run(controller, system, set, settings);
    if (!run) return null;
    run.set = set;
    run.number = number;
    run.error ??= run.rows ? errors(run.column, run.rows) : {};
    run.score ??= score(run, this.data.judged);
    return run;
  }

  /** Let the address of the page tell what is chosen. */
  #address() {
    history.replaceState(null, "", this.panel.hash || location.pathname + location.search);
  }

  get focused() {
    return this.runs.get(this.panel.focus) ?? [...this.runs.values()][0];
  }

  #draw() {
    const run = this.focused;
    if (!run?.rows) {
      this.#table();
      return;
    }
    const longest = [...this.runs.values()].reduce((a, b) => (a.rows >= b.rows ? a : b));
    const lines = (values) =>
      [...this.runs].map(([controller, one]) => ({
        label: this.data.controllers[controller],
        values: values(one),
        colour: this.data.lines[controller],
        dash: this.data.lines[controller],
      }));
    for (const axis of AXES) {
      const scaled = (one) => (axis === "psi" ? one.error.psi?.map((e) => e * DEGREES) : one.error[axis]) ?? [];
      const band = this.data.judged.settled[axis] * (axis === "psi" ? DEGREES : 1);
      const title = `Error of ${axis === "psi" ? "yaw in degrees" : `${axis} in m`} over time in s`;
      this.plots.draw($(`#plot-${axis}`), { title, time: longest.time, series: lines(scaled), band });
    }
    this.#table();
    this.#command(run);
  }

  /** Return what gives the start value of an end in a run of the one in focus. */
  #of(run) {
    const system = this.system(this.panel.focus);
    return (end) => run.set[end] ?? this.loops.own(system, end);
  }

  /** Draw the rest when the hand rests: a picture takes longer than a run where there is no GPU. */
  #rest() {
    clearTimeout(this.later);
    const run = this.focused;
    if (!run?.rows) return;
    this.later = setTimeout(
      () => {
        this.#lyapunov(run);
        this.#details(run);
        this.#arm(run);
        this.#motion(run);
      },
      this.built ? REST : 0,
    );
  }

  #lyapunov(run) {
    if (!run?.rows) return;
    const { series, note } = lyapunov(run, this.#of(run));
    const element = $("#plot-lyapunov");
    $("#note-lyapunov").textContent = note;
    element.hidden = !series;
    if (series) this.plots.draw(element, { title: "Lyapunov function in J over time in s", time: run.time, series, isLogarithmic: true });
  }

  #details(run) {
    const of = (names) =>
      names
        .filter(([name]) => run.column(name))
        .map(([name, label, colour, dash]) => ({ label, values: run.column(name), colour, dash }));
    const wrench = ["X", "Y", "Z", "N"];
    this.plots.draw($("#plot-unknown"), {
      title: "Estimated and true disturbance in N and N m",
      time: run.time,
      series: of([
        ...wrench.map((axis, i) => [`controller.disturbance.${axis}`, `${axis} estimated`, i, SOLID]),
        ...wrench.map((axis, i) => [`rov_plant.disturbance.${axis}`, `${axis} true`, i, DOTTED]),
      ]),
    });
    const thrusters = [1, 2, 3, 4, 5, 6, 7, 8];
    this.plots.draw($("#plot-thrust"), {
      title: "Thruster commands in N",
      time: run.time,
      series: of(thrusters.map((i) => [`controller.u[${i}]`, `u ${i}`, (i - 1) % 4, i > 4 ? DOTTED : SOLID])),
    });
  }

  #arm(run) {
    const links = [1, 2].map((i) => this.#of(run)(`passive_arm.L[${i}]`));
    const joints = [1, 2, 3, 4, 5, 6];
    this.plots.draw($("#plot-joints"), {
      title: "Joint angles of the arm in degrees",
      time: run.time,
      series: joints.map((i) => ({
        label: `q ${i}`,
        values: run.column(`passive_arm.q[${i}]`).map((angle) => angle * DEGREES),
        colour: (i - 1) % 3,
        dash: i > 3 ? DOTTED : SOLID,
      })),
    });
    const valid = run.column("passive_arm.eta_m_valid");
    const measured = (axis) => {
      const [given, true_] = [run.column(`passive_arm.eta_m.${axis}`), run.column(`rov_plant.eta.${axis}`)];
      return Array.from(given, (value, i) => (valid[i] ? wrapped(value - true_[i]) * SCALE[axis] : null));
    };
    for (const [name, axes, unit] of [
      ["measured", ["x", "y", "z"], "mm"],
      ["measured-psi", ["psi"], "degrees"],
    ])
      this.plots.draw($(`#plot-${name}`), {
        title: `Measured less true ${axes.length > 1 ? "position" : "yaw"} in ${unit}, where there is a measurement`,
        time: run.time,
        series: axes.map((axis, i) => ({ label: axis, values: measured(axis), colour: axes.length > 1 ? i : 2, dash: SOLID })),
      });
    const reach = run.column("passive_arm.reach");
    this.plots.draw($("#plot-reach"), {
      title: "Reach of the arm in m, and the length of its links",
      time: run.time,
      series: [
        { label: "reach", values: reach, colour: 2, dash: SOLID },
        { label: "links", values: reach.map(() => links[0] + links[1]), colour: 0, dash: DOTTED },
      ],
    });
  }

  #table() {
    const left = Math.max(OLD - (performance.now() - this.moved), 0);
    const newest = Math.max(...[...this.runs.values()].map(({ number }) => number));
    const rows = [...this.runs].map(([controller, run]) => {
      const { verdict, reason, settling, axes } = run.score;
      const cell = (axis, key) => {
        if (!axes[axis]) return "";
        return (axes[axis][key] * SCALE[axis]).toFixed(2).replace(/^-(0\.00)$/, "$1");
      };
      const cells = AXES.flatMap((axis) => [cell(axis, "mean"), cell(axis, "worst")]);
      const settled = settling === null || settling === undefined ? "never" : settling.toFixed(2);
      const label = this.data.controllers[controller];
      const checked = controller === this.panel.focus ? "checked" : "";
      return (
        `<tr data-controller="${controller}" ${run.number === newest ? "" : `class="old" style="animation-delay: ${left}ms"`}><th scope="row"><label><input type="radio" name="focus" value="${controller}" ${checked}>` +
        `<svg class="key" viewBox="0 0 34 8" aria-hidden="true"><line class="line-${this.data.lines[controller]}" x1="1" x2="33" y1="4" y2="4"/></svg>` +
        `${label}</label></th>` +
        `<td class="verdict ${verdict}" title="${reason}">${verdict}</td><td>${settled}</td>` +
        cells.map((text) => `<td>${text}</td>`).join("") +
        "</tr>"
      );
    });
    $("#results tbody").innerHTML = rows.join("");
    for (const input of document.querySelectorAll("#results input"))
      input.addEventListener("change", () => {
        this.panel.focus = input.value;
        this.#draw();
        this.#rest();
        this.#address();
        document.querySelector(`#results input[value="${input.value}"]`).focus();
      });
    $("#strip").innerHTML = [...this.runs]
      .map(([name, { score }]) => `<span class="verdict ${score.verdict}"><b>${this.data.controllers[name]}</b> ${score.verdict}</span>`)
      .join("");
    const untroubled = (controller) =>
      this.loops.troubled(this.system(controller)) ? "" : `${this.loops.trouble} does not apply, and runs without it`;
    const notes = [...this.runs].flatMap(([controller, run]) =>
      [untroubled(controller), run.failure, run.warning].filter(Boolean).map((text) => `${this.data.controllers[controller]}: ${text}`),
    );
    $("#notes").textContent = notes.join("\n");
  }

  #command(run) {
    const system = this.system(this.panel.focus);
    const { booleans } = this.data.modules[system.module];
    $("#command").textContent = command(system, run.set, this.panel.settings, booleans);
    $("#command-of").textContent = this.data.controllers[this.panel.focus];
  }

  #motion(run) {
    const of = this.#of(run);
    if (this.built !== this.panel.vehicle) this.picture?.build(of);
    else if (this.picture) this.picture.of = of;
    this.built = this.panel.vehicle;
    $("#focus-name").textContent = this.data.controllers[this.panel.focus];
    this.player.over(run.time[run.rows - 1]);
  }

  #show(time) {
    this.plots.at(time);
    if (this.picture?.of && this.focused?.rows) motion(this.picture, this.focused, time);
  }
}

/** Wait until what was drawn is on screen: a message comes after the frame. */
function painted() {
  const { port1, port2 } = new MessageChannel();
  return new Promise((resolve) => {
    port1.onmessage = resolve;
    requestAnimationFrame(() => port2.postMessage(null));
  });
}

async function copy(text, button) {
  const label = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    button.textContent = "Copy by hand";
  }
  setTimeout(() => (button.textContent = label), 1500);
}
