// A plan as people follow it: behaviours in order, merged, each with its nodes and metres.

import { byId, h, settled } from "./dom";
import type { Drafting } from "./drafting";
import type { Editor } from "./editor";
import { labelOf, type Plan } from "./types";

export class PlanPanel {
  private reason = "";
  private readonly again = settled(() => void this.drafting.plan(), 300);

  constructor(
    private readonly editor: Editor,
    private readonly drafting: Drafting,
  ) {
    drafting.noPlan = (reason) => {
      this.reason = reason;
      this.show();
    };
    editor.on(["plan", "tool"], () => this.show());
    editor.on(["graph"], () => {
      if (editor.tool === "plan" && editor.goal !== null) this.again.later();
    });
    this.show();
  }

  private show(): void {
    const { editor } = this;
    const panel = byId("plan-panel");
    panel.hidden = editor.tool !== "plan";
    byId("inspector").hidden = editor.tool === "plan";
    if (panel.hidden) return;
    const plan = editor.plans[editor.shownPlan];
    if (plan) this.reason = "";
    const { source, goal } = editor;
    const hint =
      source === null
        ? "Click the room where the robot starts."
        : goal === null
          ? "Click the room where it shall go."
          : this.reason;
    panel.replaceChildren(
      h("header", { class: "what" }, h("span", {}, "Plan"),
        h("strong", {}, source ? `${source} → ${goal ?? "…"}` : "between two rooms")),
      ...(plan ? this.planParts(plan) : [h("p", { class: "note" }, hint)]),
    );
  }

  private planParts(plan: Plan): Node[] {
    const { editor } = this;
    const { graph } = editor;
    const metres = (edges: string[]): number =>
      edges.reduce((sum, id) => sum + (graph.edges.get(id)?.length ?? 0), 0);
    let at = 0;
    const steps = plan.behaviors.map(({ behavior, count }) => {
      const edges = plan.edges.slice(at, at + count);
      at += count;
      return h("li", {}, h(
        "button",
        { type: "button", class: `step ${behavior}`, click: () => editor.goTo([], edges) },
        h("span", { class: "swatch", "aria-hidden": "true" }),
        h("b", {}, labelOf(behavior)), count > 1 && h("small", {}, `× ${count}`),
        h("span", { class: "metres" }, `${metres(edges).toFixed(1)} m`),
        h("small", { class: "to" }, `to ${plan.nodes[at]}`),
      ));
    });
    const others = editor.plans.map((other, number) =>
      h("button", {
        type: "button",
        "aria-pressed": number === editor.shownPlan ? "true" : "false",
        click: () => editor.setPlans(editor.plans, number),
      }, `${other.edges.length} steps, ${other.length.toFixed(1)} m`));
    return [
      h("p", { class: "note" },
        `${plan.nodes.length} nodes, ${plan.length.toFixed(1)} m, difficulty ${plan.difficulty}`),
      h("div", { class: "row wrap", role: "group", "aria-label": "Plans", hidden: others.length < 2 }, ...others),
      h("ol", { class: "steps" }, ...steps),
    ];
  }
}
