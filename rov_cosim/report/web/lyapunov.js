// The Lyapunov function of the paper's proof along a run: its curves, and in words what of the proof is not so in this run.
import { DOTTED, SOLID } from "./plots.js";

const [MOTION, ESTIMATE] = ["lyapunov.of_motion", "lyapunov.of_estimate"];
const MEASURED = ["noise_std", "noise_std_angle", "delay", "dropout", "encoder_counts", "bias.x", "bias.y", "bias.z"];
const THRUSTERS = ["thruster_time_constant", "thruster_dead_band", "thrust_max"];
const POSE = ["x", "y", "z", "phi", "theta", "psi"];
const XYZ = POSE.slice(0, 3);

/** Return the curves and a note; none if the controller is not the paper's law. `of` gives the start value of an end. */
export function lyapunov(run, of) {
  const [motion, estimate] = [run.column(MOTION), run.column(ESTIMATE)];
  if (!motion) return { series: null, note: "None here: the proof is of the paper's law." };
  const sum = motion.map((energy, i) => energy + estimate[i]);
  const curve = (label, values, dash) => ({ label, values: Array.from(values, positive), colour: 2, dash });
  const series = [curve("V", sum, SOLID), curve("without the estimate", motion, DOTTED)];
  const isAdapted = estimate.some((V) => V !== 0);
  const reasons = [
    [motion.some((V) => V < 0), "without the estimate it is negative at times, ε₀ is too large"],
    [!isAdapted, "nothing is adapted, and it is the energy of the motion alone"],
    [of("controller.control_roll_pitch"), "six axes are controlled, the proof has four"],
    [!of("rov_plant.lock_roll_pitch"), "roll and pitch are free, in the proof they are zero"],
    [THRUSTERS.some((name) => of(`rov_plant.${name}`) > 0), "thrusters have a lag, a dead band or a limit"],
    [[1, 2, 3, 4, 5, 6, 7, 8].some((i) => run.column(`scenario.thrust_loss[${i}]`)?.some(Boolean)), "a thruster fails"],
    [of("passive_arm.stiffness") > 0, "the arm's pull changes"],
    [moves(run, "scenario.F_umbilical", XYZ), "the umbilical's pull changes"],
    [XYZ.some((axis) => run.column(`scenario.current.${axis}`)?.some(Boolean)), "a current flows"],
    [moves(run, "scenario.eta_d", POSE), "the set-point moves"],
    [MEASURED.some((name) => of(`passive_arm.${name}`)), "what is measured is noisy, rounded, late, off or lost"],
  ];
  const found = reasons.filter(([is]) => is).map(([, words]) => words);
  const notes = [
    isAdapted && "Of forces that act alike the sum alone is learned: V ends above zero.",
    found.length && `It need not fall: ${found.join("; ")}.`,
  ];
  return { series, note: notes.filter(Boolean).join(" ") };
}

const positive = (V) => (V > 0 ? V : null); // as a logarithmic axis has it

function moves(run, name, axes) {
  return axes.some((axis) => run.column(`${name}.${axis}`)?.some((value, _, all) => value !== all[0]));
}
