// A table of results as a moving picture, with its curves.
import { Run, unpacked } from "./loops.js";
import { show as motion } from "./motion.js";
import { Player } from "./player.js";
import { Plots, SOLID } from "./plots.js";
import { AXES, errors } from "./score.js";

export class ViewPage {
  constructor(data, picture) {
    this.picture = picture;
    this.plots = new Plots((time) => this.player.seek(time));
    this.player = new Player(document.querySelector(".player"), (time) => this.#show(time), picture);
    this.#take(data);
  }

  async #take(data) {
    const bytes = await unpacked(data.columns);
    this.run = new Run({ columns: new Float64Array(bytes.buffer) }, data.names, 0);
    this.run.time = this.run.column("time");
    const { rows } = this.run;
    const geometry = new Map(Object.entries(data.geometry));
    this.picture?.build((end) => geometry.get(end));
    this.draw(data);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.picture?.recolour();
      this.draw(data);
    });
    this.player.over(this.run.time[rows - 1]);
    document.querySelector("#view").dataset.rows = rows;
  }

  draw(data) {
    const { time, column, rows } = this.run;
    const error = errors(column, rows);
    for (const axis of AXES) {
      const scale = axis === "psi" ? 180 / Math.PI : 1;
      const series = [{ label: axis, values: error[axis].map((e) => e * scale), colour: 2, dash: SOLID }];
      const title = `Error of ${axis === "psi" ? "yaw in degrees" : `${axis} in m`} over time in s`;
      this.plots.draw(document.querySelector(`#plot-${axis}`), { title, time, series, band: data.settled[axis] * scale });
    }
  }

  #show(time) {
    this.plots.at(time);
    if (this.picture) motion(this.picture, this.run, time);
  }
}
