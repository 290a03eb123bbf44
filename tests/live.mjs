// Runs a module of rov_cosim/report: node live.mjs MODULE STEP STEPS EVERY REFERENCES [REFERENCE=VALUE ...] writes the rows.
import { readFileSync, writeSync } from "node:fs";
import { Live } from "../rov_cosim/report/web/live.js";

const [path, step, steps, every, references, ...values] = process.argv.slice(2);
const live = await Live.of(readFileSync(path));
const set = values.map((one) => one.split("=").map(Number));
const { rows, message } = live.run(set, Number(step), Number(steps), Number(every), references.split(",").map(Number));
writeSync(2, message);
writeSync(1, Buffer.from(rows.buffer, rows.byteOffset, rows.byteLength));
