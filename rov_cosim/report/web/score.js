// How a run is judged, by the limits that the page was given: as rov_cosim/study/scores.py does it, which a test compares.

export const AXES = ["x", "y", "z", "psi"];

export const wrapped = (angle) => angle - 2 * Math.PI * Math.ceil(angle / (2 * Math.PI) - 0.5);

/** Return pose less set-point, a column for each of AXES; `column` gives a variable's values, or nothing. */
export function errors(column, rows) {
  return Object.fromEntries(
    AXES.map((axis) => {
      const pose = column(`rov_plant.eta.${axis}`);
      const set = column(`scenario.eta_d.${axis}`);
      const error = new Float64Array(rows);
      for (let i = 0; i < rows; i++) error[i] = pose[i] - (set ? set[i] : 0);
      return [axis, axis === "psi" ? error.map(wrapped) : error];
    }),
  );
}

/** Return the verdict, and of each axis when it settles, its final, mean and worst error in hold, in m or rad. */
export function score(run, judged) {
  const { time, error, column, failure } = run;
  const end = time.length - 1;
  if (failure) return { verdict: "lost", reason: failure, axes: {} };
  const begin = time[end] - judged.hold * (time[end] - time[0]);
  let first = time.findIndex((t) => t > begin);
  first = first < 0 ? end : first;
  const axes = {};
  for (const axis of AXES) {
    const e = error[axis];
    const n = end + 1 - first;
    let sum = 0;
    let worst = 0;
    for (let i = first; i <= end; i++) {
      sum += e[i];
      worst = Math.max(worst, Math.abs(e[i]));
    }
    const mean = sum / n;
    let spread = 0;
    for (let i = first; i <= end; i++) spread += (e[i] - mean) ** 2;
    let settled = end + 1;
    while (settled > 0 && Math.abs(e[settled - 1]) <= judged.settled[axis]) settled--;
    axes[axis] = {
      settling: settled <= end ? time[settled] : null,
      final: e[end],
      mean,
      worst,
      sway: Math.sqrt(spread / n),
    };
  }
  return { axes, verdict: verdict(run, judged, axes, first), reason: "", settling: latest(axes, begin), column };
}

function latest(axes, begin) {
  const times = AXES.map((axis) => axes[axis].settling ?? Infinity);
  const last = Math.max(...times);
  return last <= begin ? last : null;
}

function verdict({ time, column }, judged, axes, first) {
  const end = time.length - 1;
  const beyond = (key, limits) => AXES.some((axis) => Math.abs(axes[axis][key]) > limits[axis]);
  const valid = column("passive_arm.eta_m_valid");
  const blind = valid && valid.every((v, i) => v === 0 || time[i] <= time[end] - judged.unmeasured);
  const tilted = ["phi", "theta"].some((axis) =>
    column(`rov_plant.eta.${axis}`).some((angle, i) => i >= first && Math.abs(angle) > judged.capsized),
  );
  if (blind || tilted || beyond("worst", judged.lost)) return "lost";
  if (beyond("sway", judged.sway)) return "oscillates";
  return beyond("mean", judged.offset) ? "offset" : "held";
}
