// Play, pause, scrub, speed: the time that picture and plots show.

const [FEW, LONG] = [6, 45]; // so many frames of so many ms are slow

export class Player {
  /** `show` is called with the time in s whenever it changes; `picture`, if there is one, is told when it plays. */
  constructor(element, show, picture) {
    Object.assign(this, { show, picture });
    this.stop = 1;
    this.time = 0;
    this.playing = false;
    this.button = element.querySelector(".play");
    this.slider = element.querySelector(".scrub");
    this.element = element;
    this.clock = element.querySelector(".clock");
    this.speed = element.querySelector(".speed");
    this.frames = [];
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
  }

  /** Take a run of so many seconds; the time stays where it is, as far as there is one. */
  over(stop) {
    this.stop = stop;
    this.slider.max = stop;
    this.seek(Math.min(this.time, stop));
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.stop);
    this.slider.value = this.time;
    this.clock.textContent = `${this.time.toFixed(1)} s`;
    this.slider.setAttribute("aria-valuetext", this.clock.textContent);
    this.show(this.time);
  }

  toggle(on = !this.playing) {
    if (on === this.playing) return;
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
    this.picture?.play(on);
    if (!on) return;
    if (this.time >= this.stop) this.time = 0;
    this.last = undefined;
    this.frames = [];
    requestAnimationFrame((now) => this.#frame(now));
  }

  #frame(now) {
    if (!this.playing) return;
    const passed = this.last === undefined ? 0 : now - this.last;
    if (this.last !== undefined) this.frames.push(passed.toFixed(1));
    this.element.dataset.frames = this.frames.slice(-100).join(" ");
    this.last = now;
    if (this.frames.length >= FEW && this.frames.length % FEW === 0 && this.frames.slice(-FEW).every((ms) => ms > LONG)) this.picture?.coarser();
    this.seek(this.time + (Math.min(passed, 250) / 1000) * Number(this.speed.value));
    if (this.time >= this.stop) this.toggle(false);
    else requestAnimationFrame((next) => this.#frame(next));
  }
}
