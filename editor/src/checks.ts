// The faults that the Python checks find, while you draw.

import { api } from "./api";
import { byId, h, settled } from "./dom";
import type { Editor } from "./editor";
import type { Fault } from "./types";

const CHECK_AFTER_MS = 250;
const MOST_SHOWN = 200;

export class Checks {
  private asked = 0;
  private at = -1;
  private readonly soon = settled(() => void this.check(), CHECK_AFTER_MS);

  constructor(private readonly editor: Editor) {
    editor.on(["graph"], () => this.soon.later());
    editor.on(["faults"], () => this.show());
    byId("repair").addEventListener("click", () => void this.repair());
    void this.check();
  }

  next(by: 1 | -1): void {
    const { faults } = this.editor;
    if (!faults.length) {
      this.editor.say("No faults");
      return;
    }
    this.at = (this.at + by + faults.length + (this.at < 0 && by < 0 ? 1 : 0)) % faults.length;
    this.goTo(faults[this.at]!);
  }

  private async check(): Promise<void> {
    this.asked += 1;
    const turn = this.asked;
    try {
      const faults = await api.faults(this.editor.graph.toDocument());
      if (turn === this.asked) this.editor.setFaults(faults);
    } catch {
      if (turn === this.asked) byId("checks-count").textContent = "?";
    }
  }

  /** Puts right what needs no decision, as one edit. */
  private async repair(): Promise<void> {
    const { editor } = this;
    const { revision } = editor;
    try {
      const { map, fixed } = await api.repair(editor.graph.toDocument());
      if (revision !== editor.revision) return;
      editor.do(editor.patchTo(map, "fix faults"));
      editor.say(`Fixed ${fixed} faults`);
    } catch (error) {
      editor.say(`Not fixed: ${(error as Error).message}`);
    }
  }

  private goTo(fault: Fault): void {
    const name = fault.element.replace(/^\w+ /, "");
    const isNode = fault.element.startsWith("node ");
    const isEdge = fault.element.startsWith("edge ");
    const place = fault.place && { x: fault.place[0], y: fault.place[1] };
    const room = this.editor.rooms.all.find((one) => fault.element === `room ${one.name}`);
    const at = place ?? (room?.at ? { x: room.at[0], y: room.at[1] } : null);
    this.editor.goTo(isNode ? [name] : [], isEdge ? [name] : [], at);
    this.editor.say(`${fault.severity}: ${fault.element}: ${fault.message}. ${fault.remedy}`);
    this.mark(this.editor.faults.indexOf(fault));
  }

  private mark(at: number): void {
    this.at = at;
    byId("checks").querySelectorAll("li > button").forEach((button, number) => {
      if (number === at) {
        button.setAttribute("aria-current", "true");
        button.scrollIntoView({ block: "nearest" });
      } else button.removeAttribute("aria-current");
    });
  }

  private show(): void {
    const { faults } = this.editor;
    const errors = faults.filter((fault) => fault.severity === "error").length;
    const count = byId("checks-count");
    count.textContent = faults.length ? String(faults.length) : "✓";
    count.dataset["state"] = errors ? "error" : faults.length ? "warning" : "fine";
    count.title = `${errors} errors, ${faults.length - errors} warnings`;
    const fixable = faults.filter((fault) => fault.fixable).length;
    byId("repair").hidden = fixable === 0;
    byId("repair").textContent = `Fix ${fixable}`;
    const list = faults.slice(0, MOST_SHOWN).map((fault) =>
      h("li", {}, h(
        "button",
        { type: "button", class: `fault ${fault.severity}`, click: () => this.goTo(fault) },
        h("span", { class: "badge" }, fault.severity === "error" ? "Error" : "Warning"),
        h("b", {}, fault.element),
        h("span", { class: "message" }, `${capital(fault.message)}.`),
        h("span", { class: "remedy" }, `${capital(fault.remedy)}.`),
        h("small", {}, fault.paper_rule ? `${fault.rule} (rule ${fault.paper_rule})` : fault.rule),
      )));
    const more = faults.length - list.length;
    byId("checks").replaceChildren(
      list.length ? h("ol", {}, ...list) : h("p", { class: "note" }, "No faults: the map keeps all rules."),
      more > 0 ? h("p", { class: "note" }, `and ${more} more`) : "",
    );
    this.at = Math.min(this.at, faults.length - 1);
  }
}

const capital = (text: string): string => text.charAt(0).toUpperCase() + text.slice(1);
