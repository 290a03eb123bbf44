// Runs a module of rov_cosim/report: node live.mjs MODULE STEP STEPS REFERENCES [REFERENCE=VALUE ...] writes the columns.
import { readFileSync, writeSync } from "node:fs";
import { Live } from "../rov_cosim/report/web/live.js";

const [path, step, steps, references, ...values] = process.argv.slice(2);
const live = await Live.of(readFileSync(path));
const set = values.map((one) => one.split("=").map(Number));
const { columns, message } = live.run(set, Number(step), Number(steps), references.split(",").map(Number));
writeSync(2, message);
writeSync(1, Buffer.from(columns.buffer));
