// Runs one module, apart from the page, so that the hand on a slider never waits.
import { Live } from "./live.js";

let live;

onmessage = async ({ data }) => {
  if (data.module) {
    live = Live.of(data.module);
    return;
  }
  const found = (await live).run(data.values, data.step, data.steps, data.references);
  postMessage(found, [found.columns.buffer]);
};
