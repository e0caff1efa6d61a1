/** The page: its parts, buttons and keys. README.md describes `window.motionmind`. */

import { Body } from "motionmind/body";
import { writeCredits } from "motionmind/credits";
import { Filming } from "motionmind/filming";
import { Ensemble, GroupStage, writeDancers } from "motionmind/group";
import { listen, writeKeys } from "motionmind/keys";
import { writeLegend } from "motionmind/legend";
import { MOMENT, Motion } from "motionmind/motion";
import { Pictures } from "motionmind/pictures";
import { Plan } from "motionmind/plan";
import { Player } from "motionmind/player";
import { Sound } from "motionmind/sound";
import { Stage } from "motionmind/stage";
import { Theme } from "motionmind/theme";
import { Timeline } from "motionmind/timeline";

const VIEWS = ["front", "side", "top", "quarter"];
const ROOMY = { width: 680, height: 380 }; // CSS pixels: on a stage at least as large, the legend starts open

const $ = (id) => document.getElementById(id);

function start() {
  const data = JSON.parse($("data").textContent);
  const motion = data.dancers ? new Ensemble(data) : new Motion(data);
  const body = motion.body ?? new Body(data.skeleton, data.body);
  const player = new Player(motion);
  const pictures = new Pictures(player, () => {
    if (filming.running) return;
    stage.show(player.time, ghosts());
    stage.render(player.playing, pictures.late);
  });
  const stage = makeStage(motion, body, data.colours, () => pictures.ask());
  if (!stage) return;
  const timeline = new Timeline($("timeline"), player, data.colours);
  const moving = motion.length > 1;
  for (const element of document.querySelectorAll(".moving")) element.hidden = !moving;
  if (motion.dancers) writeDancers($("dancers"), motion, () => pictures.ask());
  if (motion.dancers) for (const id of ["ghosts", "plan"]) $(id).hidden = true; // of one body
  $("ends").hidden = motion.insertions.every((insertion) => motion.ends(insertion).length === 0);
  writeLegend($("legend").querySelector("ul"), motion.painted ?? motion, body, data.colours);
  writeCredits($("credits"), data.credits);
  $("legend").open = $("stage").clientWidth >= ROOMY.width && $("stage").clientHeight >= ROOMY.height;
  writeKeys($("sheet").querySelector("dl"), motion);

  const refresh = () => {
    pictures.ask();
    describe(player);
  };
  player.addEventListener("change", refresh);
  const theme = new Theme();
  const colour = () => {
    stage.dark = theme.dark;
    timeline.draw();
    $("dark").setAttribute("aria-pressed", String(theme.dark));
    pictures.ask();
  };
  theme.addEventListener("change", colour);
  colour();
  const sound = motion.sound && makeSound(player, motion.sound);
  bind(player, stage, theme, sound, refresh, data.stage);
  if (motion.dancers) stage.area = data.stage; // they have no plan
  const ghosts = () => ({ ends: pressed("ends"), onion: pressed("onion") ? Number($("apart").value) : 0 });
  const filming = new Filming($("film"), $("filming"), stage, player, ghosts);

  timeline.update();
  refresh();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player.play();

  window.motionmind = { motion, body, player, sound, stage, theme, timeline, solids: (...which) => solids(motion, body, ...which) };
}

/** Make the stage; if the browser cannot draw it, show a message and return undefined. */
function makeStage(motion, ...things) {
  try {
    return new (motion.dancers ? GroupStage : Stage)($("canvas"), motion, ...things);
  } catch (error) {
    $("message").hidden = false;
    $("message").textContent =
      "This browser cannot show the movement: WebGL 2 is not available. " +
      "Turn on hardware acceleration in its settings, or open the page in another browser.";
    for (const element of document.querySelectorAll("footer, #views, #page, #dancers, #legend, #credits, #canvas")) element.hidden = true;
    return undefined;
  }
}

/** Make the sound, and wake it with the first click or key. */
function makeSound(player, file) {
  const sound = new Sound(player, file);
  $("sound").hidden = false;
  sound.addEventListener("change", () => $("sound").setAttribute("aria-pressed", String(sound.audible)));
  document.addEventListener("pointerup", (event) => event.target.closest("#sound") || sound.wake());
  document.addEventListener("keydown", (event) => "s" === event.key.toLowerCase() || sound.wake());
  return sound;
}

/** Buttons and keys. */
function bind(player, stage, theme, sound, refresh, area) {
  const switched = (id) => () => {
    $(id).setAttribute("aria-pressed", String(!pressed(id)));
    refresh();
  };
  const look = (view) => () => {
    stage.look(view);
    for (const name of VIEWS) $(name).setAttribute("aria-pressed", String(name === view));
    refresh();
  };
  const plan = new Plan(stage, area);
  const floorPlan = () => {
    plan.shown = !plan.shown;
    $("plan").setAttribute("aria-pressed", String(plan.shown));
    look(plan.shown ? "top" : "quarter")();
  };
  const actions = {
    play: () => player.toggle(),
    back: () => player.step(-1),
    forward: () => player.step(1),
    loop: () => (player.loop = !player.loop),
    sound: () => sound?.toggle(),
    onion: switched("onion"),
    ends: switched("ends"),
    plan: floorPlan,
    reset: look("quarter"),
    dark: () => theme.toggle(),
    help: () => $("sheet").showModal(),
    ...Object.fromEntries(VIEWS.map((view) => [view, look(view)])),
  };
  for (const [id, action] of Object.entries(actions)) {
    $(id).addEventListener("click", action);
  }
  document.addEventListener("click", (event) => {
    // After a click, not a key: the space bar continues to play and pause.
    if (event.detail > 0) event.target.closest("button, summary")?.blur();
  });
  for (const select of document.querySelectorAll("select")) {
    select.addEventListener("change", () => select.matches(":focus-visible") || select.blur());
  }
  stage.controls.addEventListener("start", () => {
    for (const name of VIEWS) $(name).setAttribute("aria-pressed", "false");
  });
  $("speed").addEventListener("change", () => (player.speed = Number($("speed").value)));
  $("apart").addEventListener("change", () => {
    $("onion").setAttribute("aria-pressed", "true"); // or nothing would happen
    refresh();
  });

  const { motion } = player;
  const starts = motion.insertions.map(({ times }) => times[0]);
  listen(
    {
      ...actions,
      home: () => player.seek(motion.start),
      end: () => player.seek(motion.end),
      previous: () => player.seek(starts.findLast((time) => time < player.time - MOMENT) ?? starts.at(-1)),
      next: () => player.seek(starts.find((time) => time > player.time + MOMENT) ?? starts[0]),
      legend: () => ($("legend").open = !$("legend").open),
    },
    motion,
    stage.controls,
  );
}

/** Write the player's frame, time and state. */
function describe(player) {
  const { motion, frame, time } = player;
  $("play").setAttribute("aria-label", player.playing ? "Pause" : "Play");
  $("play").dataset.playing = player.playing;
  $("loop").setAttribute("aria-pressed", String(player.loop));
  const bridged = motion.bridgedAt(time).map((joint) => motion.joints[joint]);
  $("frame").textContent = `frame ${motion.first + frame} of ${motion.first + motion.length - 1}`;
  $("time").textContent = `${time.toFixed(2)} s`;
  $("inserted").hidden = !motion.insertedAt(time);
  $("bridged").hidden = bridged.length === 0;
  $("bridged").textContent = `bridged: ${bridged.join(", ")}`;
}

function pressed(id) {
  return $(id).getAttribute("aria-pressed") === "true";
}

/** The solids of a frame, in the world: eight numbers a cone and twelve an ellipsoid, as Body writes them; of a dancer. */
function solids(motion, shared, frame, number = 0) {
  const one = motion.dancers?.[number] ?? motion;
  const body = one.body ?? shared;
  const rotations = new Float64Array(body.parents.length * 4);
  const root = new Float64Array(3);
  one.sample(motion.times[frame], rotations, root);
  body.pose(rotations, root);
  const found = { cones: new Array(body.cones.length * 8), balls: new Array(body.balls.length * 12) };
  body.writeCones(found.cones);
  body.writeBalls(found.balls);
  return { ...found, joints: [...body.joints] };
}

start();
