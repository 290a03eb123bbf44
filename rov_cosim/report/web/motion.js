// A time of a run in the picture, of whatever has `rows`, `time`, `at(name, row)`.

export function show(picture, run, time) {
  const { time: times, rows } = run;
  let row = Math.round((time / times[rows - 1]) * (rows - 1)) || 0;
  while (row > 0 && times[row] > time) row--;
  while (row < rows - 1 && times[row + 1] <= time) row++;
  const place = (share) => ["x", "y", "z"].map((axis) => run.at(`rov_plant.eta.${axis}`, Math.round(share * row)));
  picture.show((name) => run.at(name, row), time, place);
}
