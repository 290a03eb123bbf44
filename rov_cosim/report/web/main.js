// What runs when the page is there: the loops, or the motion of a table of results.
import { LivePage } from "./live-page.js";
import { Picture } from "./scene.js";
import { ViewPage } from "./view-page.js";

const data = JSON.parse(document.querySelector("#data").textContent);
const stage = document.querySelector("#stage");

function picture() {
  try {
    return new Picture(stage);
  } catch {
    stage.textContent = "There is no WebGL here, and so no moving picture; all else works.";
    return null;
  }
}

if (data.columns) new ViewPage(data, picture());
else new LivePage(data, document.querySelector("#worker").textContent, picture());
