// A system as a module of WebAssembly, made of ../c/live.c.

export class Live {
  /** Make it of the module's bytes. */
  static async of(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes);
    return new Live(instance.exports);
  }

  constructor(exports) {
    this.c = exports;
    this.c._initialize();
    this.room = { references: { at: 0, size: 0 }, columns: { at: 0, size: 0 } };
  }

  /**
   * Run anew from the system's own values but for `values`, pairs of value reference and number.
   *
   * `columns` has one for each of `references`, of the values at the start and after each of the steps of `step` seconds.
   * If they end early, `message` has why; `warning` is the first that the run gave, or empty.
   */
  run(values, step, steps, references) {
    const n = references.length;
    const places = this.#room("references", 4 * n);
    const whole = steps + 1;
    const at = this.#room("columns", 8 * n * whole);
    const well = this.c.live_begin() && values.every(([reference, value]) => this.c.live_set(reference, value));
    new Uint32Array(this.c.memory.buffer, places, n).set(references);
    const done = well ? this.c.live_run(step, steps, places, n, at) : 0;
    const columns = new Float64Array(n * done);
    for (let i = 0; i < n; i++) columns.set(new Float64Array(this.c.memory.buffer, at + 8 * i * whole, done), i * done);
    return {
      columns,
      message: done < whole ? this.#text(this.c.live_message()) : "",
      warning: this.#text(this.c.live_warning()),
    };
  }

  #room(name, size) {
    const room = this.room[name];
    if (room.size < size) Object.assign(room, { at: this.c.live_room(size), size });
    return room.at;
  }

  #text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer, at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }
}
