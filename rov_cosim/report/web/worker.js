// Runs one module, apart from the page, so that the hand on a slider never waits.
import { Live } from "./live.js";

let live;

onmessage = async ({ data }) => {
  if (data.module) {
    live = Live.of(data.module);
    return;
  }
  const begun = performance.now();
  const { rows, message, warning } = (await live).run(data.values, data.step, data.steps, 1, data.references);
  const columns = transposed(rows, data.references.length);
  postMessage({ columns, message, warning, took: performance.now() - begun }, [columns.buffer]);
};

function transposed(rows, n) {
  const count = rows.length / n;
  const columns = new Float64Array(rows.length);
  for (let i = 0, k = 0; i < count; i++) for (let j = 0; j < n; j++) columns[j * count + i] = rows[k++];
  return columns;
}
