// The loops that run in the page: a worker for each controller, the values of each run, and the command that repeats it.

export async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

export class Loops {
  constructor(data, workerSource) {
    this.data = data;
    this.source = URL.createObjectURL(new Blob([workerSource], { type: "text/javascript" }));
    this.workers = {};
    this.places = data.modules.map(({ names }) => new Map(names.map((name, i) => [name, i])));
    this.bytes = data.modules.map(() => null);
  }

  /** Return where a system has a variable; undefined if it has none. */
  place({ module }, end) {
    return this.places[module].get(end);
  }

  /** Return the value that a system has by itself, in the trouble that is chosen. */
  own(system, end) {
    const place = this.place(system, end);
    if (place === undefined) return undefined;
    return system.troubles[this.trouble]?.[end] ?? system.values[place] ?? this.data.modules[system.module].start[place];
  }

  limited(system, place, value) {
    const [low, high] = this.data.modules[system.module].limits[place] ?? [null, null];
    return Math.min(Math.max(value, low ?? -Infinity), high ?? Infinity);
  }

  /** Tell whether the trouble that is chosen, if one is, comes over a system. */
  troubled(system) {
    return !this.trouble || this.trouble in system.troubles;
  }

  /** Return what the trouble and the controls set of a system, by `element.variable`. */
  set(system, controls, chosen) {
    const values = { ...system.troubles[this.trouble] };
    for (const control of controls) {
      const word = chosen[control.key];
      if (word === undefined) continue;
      if (control.kind === "choice") {
        for (const [end, value] of Object.entries(control.options[word] ?? {}))
          if (this.place(system, end) !== undefined) values[end] = Number(value);
        continue;
      }
      for (const end of control.ends) {
        const place = this.place(system, end);
        if (place === undefined) continue;
        const own = this.own(system, end);
        const value = control.kind === "factor" ? Number((own * word).toPrecision(4)) : word;
        const set = this.limited(system, place, value);
        if (set !== own) values[end] = set;
      }
    }
    return values;
  }

  /** Run a controller's system, unless its last run was the same; of several requests the last is answered, the others with null. */
  run(controller, system, set, settings) {
    const worker = this.#worker(controller, system.module);
    const { recorded, step, coupling } = this.data;
    const places = recorded.map((name) => this.place(system, name));
    const known = recorded.filter((_, i) => places[i] !== undefined);
    const values = Object.entries(system.values).filter(([, value]) => value !== null);
    const request = {
      values: [
        ...values.map(([place, value]) => [Number(place), value]),
        ...Object.entries(set).map(([end, value]) => [this.place(system, end), value]),
        [this.place(system, coupling), settings.coupling],
      ],
      step,
      steps: Math.round(settings.stop / step),
      references: places.filter((place) => place !== undefined),
    };
    const asked = JSON.stringify(request);
    worker.next?.resolve(null);
    worker.next = null;
    if (!worker.busy && worker.done?.asked === asked) return worker.done.run;
    return new Promise((resolve) => {
      worker.next = { asked, request, resolve, known };
      this.#begin(worker);
    });
  }

  #worker(controller, module) {
    let worker = this.workers[controller];
    if (worker?.module === module) return worker;
    worker?.thread.terminate();
    worker = { thread: new Worker(this.source), module, busy: true };
    this.workers[controller] = worker;
    worker.thread.onmessage = ({ data }) => {
      const { asked, resolve, known, request } = worker.now;
      worker.busy = false;
      worker.done = { asked, run: new Run(data, known, request.step) };
      resolve(worker.done.run);
      this.#begin(worker);
    };
    this.bytes[module] ??= unpacked(this.data.modules[module].wasm);
    this.bytes[module].then((bytes) => {
      worker.thread.postMessage({ module: bytes });
      worker.busy = false;
      this.#begin(worker);
    });
    return worker;
  }

  #begin(worker) {
    if (worker.busy || !worker.next) return;
    worker.now = worker.next;
    worker.next = null;
    worker.busy = true;
    worker.thread.postMessage(worker.now.request);
  }
}

/** What a run recorded, column after column. */
export class Run {
  constructor({ columns, message, warning }, names, step) {
    this.names = new Map(names.map((name, i) => [name, i]));
    this.rows = columns.length / names.length;
    this.columns = columns;
    this.failure = message;
    this.warning = warning;
    this.time = new Float64Array(this.rows);
    for (let i = 0; i < this.rows; i++) this.time[i] = i * step;
    this.column = this.column.bind(this);
  }

  at(name, row) {
    const place = this.names.get(name);
    return place === undefined ? undefined : this.columns[place * this.rows + row];
  }

  column(name) {
    const place = this.names.get(name);
    return place === undefined ? undefined : this.columns.subarray(place * this.rows, (place + 1) * this.rows);
  }
}

/** Return the command that repeats a run. */
export function command(system, set, settings, booleans) {
  const words = ["rov-cosim", "run", system.name, "--stop-time", String(settings.stop)];
  if (settings.coupling === 1) words.push("--coupling", "gauss-seidel");
  for (const [end, value] of Object.entries(set))
    words.push("--set", `${end}=${booleans.includes(end) ? Boolean(value) : value}`);
  return words.map((word) => (/^[\w.=,:\/+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`)).join(" ");
}
