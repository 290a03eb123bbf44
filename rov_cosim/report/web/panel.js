// The controls: what is chosen, told as a link and as values.

const PLACES = 200; // of a logarithmic slider
const isLogarithmic = ({ kind, low }) => kind === "factor" && low > 0;

export class Panel {
  /** `changed` is called whenever something else is chosen. */
  constructor(element, data, loops, changed) {
    Object.assign(this, { element, data, loops, changed });
    this.controls = data.controls.flatMap(({ controls }) => controls);
    this.inputs = new Map();
    this.values = {}; // what is chosen, by the key of its control
    this.vehicleInput = choice(document.querySelector("#vehicle"), Object.entries(data.vehicles));
    this.vehicleInput.addEventListener("change", () => this.#vehicle(this.vehicleInput.value));
    const troubles = Object.entries(data.troubles).map(([name, description]) => [name, `${name}: ${description}`]);
    this.troubleInput = choice(document.querySelector("#trouble"), [["", "none"], ...troubles]);
    this.troubleInput.addEventListener("change", () => this.#trouble(this.troubleInput.value));
    this.stopInput = document.querySelector("#stop");
    this.couplingInput = document.querySelector("#coupling");
    for (const input of [this.stopInput, this.couplingInput]) input.addEventListener("change", () => this.changed());
    this.boxes = this.#controllers(document.querySelector("#shown"));
    data.controls.forEach(({ group, controls }, i) => this.element.append(this.#group(group, controls, i === 0)));
  }

  get defaults() {
    return {
      vehicle: Object.keys(this.data.vehicles)[0],
      shown: this.data.first,
      focus: this.data.first.at(-1),
      stop: this.data.stop_time,
      coupling: 0,
    };
  }

  get shown() {
    const shown = Object.keys(this.boxes).filter((name) => this.boxes[name].checked);
    return shown.length ? shown : [this.focus];
  }

  get settings() {
    return { stop: Number(this.stopInput.value), coupling: Number(this.couplingInput.value) };
  }

  /** How much heavier the vehicle is than the paper's: forces go with it. */
  get scale() {
    const mass = this.loops.own(Object.values(this.data.systems[this.vehicle])[0], "rov_plant.mass");
    return Number((mass / 80).toPrecision(2));
  }

  /** All that differs from the page as it comes, as the part of a link after #. */
  get hash() {
    const d = this.defaults;
    const words = [];
    if (this.vehicle !== d.vehicle) words.push(["vehicle", this.vehicle]);
    if (this.shown.join() !== Object.keys(this.boxes).filter((name) => d.shown.includes(name)).join())
      words.push(["shown", this.shown.join()]);
    if (this.focus !== d.focus) words.push(["focus", this.focus]);
    if (this.settings.stop !== d.stop) words.push(["stop", this.settings.stop]);
    if (this.settings.coupling) words.push(["coupling", this.settings.coupling]);
    if (this.loops.trouble) words.push(["trouble", this.loops.trouble]);
    words.push(...Object.entries(this.values));
    return words.length ? "#" + new URLSearchParams(words) : "";
  }

  /** Choose what a link says. */
  read(hash) {
    const words = new URLSearchParams(hash.slice(1));
    const d = this.defaults;
    const known = (word, among, otherwise) => (Object.hasOwn(among, word) ? word : otherwise);
    this.vehicle = known(words.get("vehicle"), this.data.vehicles, d.vehicle);
    this.vehicleInput.value = this.vehicle;
    this.troubleInput.value = this.loops.trouble = known(words.get("trouble"), this.data.troubles, "");
    const shown = (words.get("shown")?.split(",") ?? d.shown).filter((name) => this.boxes[name]);
    for (const [name, box] of Object.entries(this.boxes)) box.checked = shown.includes(name);
    this.focus = known(words.get("focus"), this.boxes, shown.includes(d.focus) ? d.focus : shown.at(-1) ?? d.focus);
    const stop = Number(words.get("stop"));
    this.stopInput.value = stop >= 3 && stop <= 600 ? stop : d.stop;
    this.couplingInput.value = words.get("coupling") === "1" ? "1" : "0";
    this.values = {};
    for (const control of this.controls) {
      const word = words.get(control.key);
      if (word === null) continue;
      if (control.kind === "choice" ? Object.hasOwn(control.options, word) : Number.isFinite(Number(word)))
        this.values[control.key] = control.kind === "choice" ? word : Number(word);
    }
    this.#refresh();
    this.changed();
  }

  reset() {
    this.values = {};
    this.troubleInput.value = this.loops.trouble = "";
    this.stopInput.value = this.defaults.stop;
    this.couplingInput.value = "0";
    this.#refresh();
    this.changed();
  }

  #vehicle(name) {
    this.vehicle = name;
    this.values = {};
    this.#refresh();
    this.changed();
  }

  /** Take a trouble, and so long a run that what comes in it is seen. */
  #trouble(name) {
    this.loops.trouble = name;
    const systems = Object.values(this.data.systems[this.vehicle]);
    const comes = systems.some(({ troubles }) => Object.values(troubles[name] ?? {}).includes(this.data.onset));
    if (comes) this.stopInput.value = Math.max(this.settings.stop, 2.5 * this.data.onset);
    this.#refresh();
    this.changed();
  }

  #controllers(element) {
    const boxes = {};
    for (const [name, label] of Object.entries(this.data.controllers)) {
      const box = Object.assign(document.createElement("input"), { type: "checkbox", value: name });
      const line = document.createElement("label");
      line.append(box, label);
      element.append(line);
      boxes[name] = box;
      box.addEventListener("change", () => {
        if (box.checked) this.focus = name;
        else if (this.focus === name) this.focus = this.shown.at(-1);
        this.changed();
      });
    }
    return boxes;
  }

  #group(name, controls, open) {
    const group = Object.assign(document.createElement("details"), { open });
    group.innerHTML = `<summary>${name}</summary>`;
    for (const control of controls) group.append(this.#control(control));
    return group;
  }

  #control(control) {
    const line = document.createElement("label");
    line.className = "control";
    const name = Object.assign(document.createElement("span"), { className: "name", textContent: control.label });
    const shown = Object.assign(document.createElement("output"), { className: "value" });
    if (control.kind === "choice") {
      const select = document.createElement("select");
      choice(select, Object.keys(control.options).map((option) => [option, option]));
      select.addEventListener("change", () => this.#choose(control, select.value));
      line.append(name, select);
      this.inputs.set(control, { input: select, shown });
      return line;
    }
    const input = Object.assign(document.createElement("input"), { type: "range" });
    input.dataset.key = control.key;
    input.addEventListener("input", () => this.#choose(control, this.#value(control, Number(input.value))));
    line.append(name, shown, input);
    this.inputs.set(control, { input, shown });
    return line;
  }

  #choose(control, value) {
    if (value === this.#own(control)) delete this.values[control.key];
    else this.values[control.key] = value;
    this.#label(control);
    this.changed();
  }

  /** What a control is when nothing is chosen: of the first system that has what it sets. */
  #own(control) {
    if (control.kind === "choice") return Object.keys(control.options)[0];
    if (control.kind === "factor") return 1;
    for (const system of Object.values(this.data.systems[this.vehicle])) {
      const own = this.loops.own(system, control.ends[0]);
      if (own !== undefined) return own;
    }
    return 0;
  }

  // A factor's slider is logarithmic, with 1 in the middle, unless it begins at 0.

  #value(control, place) {
    if (isLogarithmic(control)) return Number((control.low * (control.high / control.low) ** (place / PLACES)).toPrecision(3));
    const step = this.#range(control)[2];
    return Number((Math.round(place / step) * step).toPrecision(6));
  }

  #place(control, value) {
    const { low, high } = control;
    return isLogarithmic(control) ? (PLACES * Math.log(value / low)) / Math.log(high / low) : value;
  }

  #range(control) {
    const times = control.kind === "force" ? this.scale : 1;
    const [low, high] = [control.low * times, control.high * times];
    if (control.kind !== "factor") return [low, high, control.step * times];
    return isLogarithmic(control) ? [0, PLACES, 1] : [low, high, 0.05];
  }

  #refresh() {
    for (const [control, { input }] of this.inputs) {
      if (control.kind !== "choice") [input.min, input.max, input.step] = this.#range(control);
      const value = this.values[control.key] ?? this.#own(control);
      input.value = control.kind === "choice" ? value : this.#place(control, value);
      this.#label(control);
    }
  }

  #label(control) {
    const { input, shown } = this.inputs.get(control);
    const value = this.values[control.key] ?? this.#own(control);
    input.closest("label").classList.toggle("changed", control.key in this.values);
    if (control.kind === "choice") return;
    const number = Number(value.toPrecision(3));
    shown.textContent = control.kind === "factor" ? `× ${number}` : `${number} ${control.unit}`.trim();
    input.setAttribute("aria-valuetext", shown.textContent);
  }
}

function choice(select, options) {
  for (const [value, text] of options) select.append(new Option(text, value));
  return select;
}
