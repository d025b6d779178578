// The buttons that ask the server for work, and what comes of it.

const LOOK_EVERY = 200; // milliseconds between two looks at work that goes on

class Live {
  constructor(parts) {
    Object.assign(this, parts);
    this.known = this.ended = 0; // pieces of news, and the number of the last job that has ended
    const wanted = location.hash; // before the page writes what it opens at
    this.trials = new Map();
    this.added = new AddedPoints(this.atlas, this.selection);
    this.table.also = (reads) => reads.flatMap(({ grasp }) => this.trialOf(grasp));
    this.menus();
    this.buttons();
    this.selection.on("grasps", () => this.offerGrasps());
    this.offerGrasps();
    this.look(true).then(() => {
      if (wanted && wanted !== location.hash) history.replaceState(null, "", wanted);
      this.address.follow(); // it may name grasps that have been added
      document.documentElement.dataset.live = "yes";
    });
  }

  menus() {
    byId("index").closest(".bar").append(byId("live-index"));
    const left = facts.live.indices.filter((name) => !facts.indices.some((index) => index.name === name));
    fill(byId("live-index"), ["another index\u2026", ...left.map((name) => name.replaceAll("_", " "))], 0, (i) => {
      if (i) this.ask({ action: "index", index: byId("live-index").options[i].text.replaceAll(" ", "_") });
      byId("live-index").selectedIndex = 0;
    });
    offer(byId("live-protocol"), ...facts.live.protocols);
    byId("live-protocol").hidden = !facts.live.mujoco;
    if (!facts.live.mujoco) {
      const button = byId("live-simulate");
      button.disabled = true;
      button.dataset.off = "yes";
      button.textContent = "simulate: pip install 'graspatlas[mujoco]'";
    }
    if (!facts.live.file) byId("live-save").dataset.off = "yes";
  }

  buttons() {
    const grasp = () => this.choices[byId("live-grasp").selectedIndex];
    const when = (id, body) => byId(id).addEventListener("click", () => this.ask(body()));
    when("live-climb", () => ({ action: "climb", grasp: grasp(), all_motions: byId("live-free").checked }));
    when("live-densify", () => ({ action: "densify", grasp: grasp() }));
    when("live-simulate", () => ({ action: "simulate", grasp: grasp(), protocol: byId("live-protocol").value }));
    when("live-save", () => ({ action: "save", result: byId("live-result").checked }));
    when("live-stop", () => ({ action: "stop" }));
    this.enable(false);
  }

  // The pinned grasps, or the one that is looked at; a pinned one that is new is chosen.
  offerGrasps() {
    const { selection } = this, choices = selection.pins.length ? [...selection.pins] : [selection.focus];
    const menu = byId("live-grasp"), before = this.choices || [];
    if (choices.join() === before.join()) return;
    const last = before[menu.selectedIndex], fresh = choices.filter((grasp) => !before.includes(grasp));
    const chosen = fresh.length === 1 ? fresh[0] : choices.includes(last) ? last : choices[0];
    menu.replaceChildren();
    offer(menu, ...choices.map((grasp, i) => {
      const letter = selection.pins.length > 1 ? `${"AB"[i]}: ` : "";
      return letter + selection.title(grasp)[0].toLowerCase() + (grasp < facts.n_charts && !/chart/i.test(selection.title(grasp)[0]) ? `, chart ${grasp}` : "");
    }));
    menu.selectedIndex = choices.indexOf(chosen);
    this.choices = choices;
  }

  async ask(body) {
    try {
      const { job } = await asked("ask", body);
      this.waited = job && job.number;
      await this.look(false);
    } catch (error) {
      this.say(error.message, true);
    }
  }

  // What is new; again and again while work goes on.
  async look(first) {
    clearTimeout(this.timer);
    let state;
    try {
      state = await asked(`news?since=${this.known}`);
    } catch (error) {
      this.say(error.message, true);
      this.enable(false);
      return;
    }
    for (const one of state.news) await this.hear(one, first);
    this.known += state.news.length;
    byId("live-save").disabled = this.off("live-save") || !this.known;
    const { job } = state;
    this.enable(Boolean(job && job.running), state.unsaved);
    if (!job || (first && !job.running)) return;
    this.tell(job);
    if (job.running) {
      this.timer = setTimeout(() => this.look(false), LOOK_EVERY);
      return;
    }
    if (job.number === this.waited && job.show.length) this.selection.show(...job.show);
    this.ended = job.number;
  }

  tell(job) {
    const share = job.total ? job.done / job.total : null, bar = byId("live-progress");
    if (share === null) bar.removeAttribute("value");
    else bar.value = share;
    const far = job.total ? `${job.done} of ${job.total} ` : "";
    this.say(`${job.name}: ${job.running ? (job.stopping ? "stopping\u2026" : far + job.text) : job.text}`, job.error);
  }

  say(text, error = false) {
    byId("live-text").textContent = text;
    byId("live-work").dataset.error = error ? "yes" : "no";
  }

  off(id) {
    return byId(id).dataset.off === "yes";
  }

  enable(running, unsaved = 0) {
    for (const id of ["live-climb", "live-densify", "live-simulate", "live-index"]) byId(id).disabled = running || this.off(id);
    byId("live-save").disabled = running || this.off("live-save") || !this.known;
    byId("live-save").textContent = unsaved ? `save (${unsaved})` : "save";
    byId("live-progress").hidden = byId("live-stop").hidden = !running;
  }

  async hear(news, first) {
    if (news.kind === "trial") {
      this.trials.set(news.grasp, [...(this.trials.get(news.grasp) || []), news.lines]);
      this.selection.tell("grasps");
      return;
    }
    const numbers = new Numbers(await inflated(bytesOf(news.data)), news.entries);
    if (news.kind === "index") this.addIndex(news.index, numbers.get("values"), !first);
    else this.addGrasps(news.grasps, numbers);
  }

  addIndex(index, values, chosen) {
    const { selection, atlas } = this, i = facts.indices.length;
    facts.indices.push(index);
    selection.columns.push(values);
    atlas.coordinates.push([index.label, () => Float64Array.from(selection.columns[i])]);
    for (const id of ["index", "other", "axis-0", "axis-1", "axis-2"]) offer(byId(id), index.label);
    const menu = byId("live-index");
    [...menu.options].find((option) => option.text === index.label)?.remove();
    if (!chosen) return;
    byId("index").selectedIndex = i;
    selection.change({ index: i });
  }

  addGrasps(entries, numbers) {
    const { selection, grasps, atlas } = this;
    facts.maxima.push(...entries);
    selection.count = grasps.count = facts.n_charts + facts.maxima.length;
    grasps.numbers.append(numbers);
    selection.columns.forEach((column, i) => {
      selection.columns[i] = chained(column, numbers.get(`index_${i}`));
    });
    selection.rejections = chained(selection.rejections, numbers.get("rejections"));
    atlas.extend();
  }

  trialOf(grasp) {
    const trials = this.trials.get(grasp) || [];
    return trials.map((lines) => element("p", { className: "trial" }, element("b", { textContent: `Simulated: ${lines[0]}.` }), ` ${lines.slice(1).join(" ")}`));
  }
}

started.then((parts) => { parts.live = new Live(parts); });
