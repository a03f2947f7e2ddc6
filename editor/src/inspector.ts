// What is selected, in fields: one node, one edge, or many elements at once.

import type { Actions } from "./commands";
import { eachFrame, h } from "./dom";
import type { Editor } from "./editor";
import { rename, replaceNodes } from "./edits";
import { distance, tidy } from "./geometry";
import { BEHAVIORS, type Behavior, KINDS, labelOf, type MapEdge, type MapNode } from "./types";

const degrees = (rad: number): number => Math.round((rad * 180) / Math.PI);

export class Inspector {
  private shown = "";
  private subject = "";
  private typing: EventTarget | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
    private readonly actions: Actions,
  ) {
    const update = eachFrame(() => this.update());
    editor.on(["selection", "graph", "tool"], update);
    root.addEventListener("input", (event) => (this.typing = event.target));
    for (const end of ["change", "focusout"]) {
      root.addEventListener(end, () => {
        this.typing = null;
        update();
      });
    }
    this.update();
  }

  private update(): void {
    const { editor } = this;
    if (editor.dragging) {
      this.followDrag();
      return;
    }
    const key = this.key();
    if (key === this.shown) return;
    const subject = JSON.stringify([...editor.nodes, "|", ...editor.edges]);
    // Fields built anew would take what is being typed; they follow when it is set.
    if (this.typing === document.activeElement && this.typing && subject === this.subject) return;
    const focused = this.root.contains(document.activeElement) ? document.activeElement : null;
    this.shown = key;
    this.subject = subject;
    const node = only(editor.nodes, editor.edges, editor.graph.nodes);
    const edge = only(editor.edges, editor.nodes, editor.graph.edges);
    if (node) this.root.replaceChildren(...this.nodeFields(node));
    else if (edge) this.root.replaceChildren(...this.edgeFields(edge));
    else if (editor.hasSelection) this.root.replaceChildren(...this.manyFields());
    else this.root.replaceChildren(...this.nothing());
    if (focused?.id) focusAgain(focused);
  }

  /** While a node is dragged only its place changes: building the fields anew takes too long. */
  private followDrag(): void {
    const node = only(this.editor.nodes, this.editor.edges, this.editor.graph.nodes);
    for (const axis of ["x", "y"] as const) {
      const input = this.root.querySelector<HTMLInputElement>(`#node-${axis}`);
      if (node && input) input.value = String(node[axis]);
    }
  }

  /** Changes when anything that is shown does. */
  private key(): string {
    const { editor } = this;
    const node = only(editor.nodes, editor.edges, editor.graph.nodes);
    const edge = only(editor.edges, editor.nodes, editor.graph.edges);
    const near = node ? editor.graph.edgesAt(node.id) : [];
    return JSON.stringify([
      node,
      edge,
      near,
      node || edge ? null : [...editor.nodes, "|", ...editor.edges],
      this.commonKind(),
      this.commonBehavior(),
      editor.tool,
      editor.kind,
      editor.behavior,
      editor.hasSelection ? 0 : [editor.graph.nodes.size, editor.graph.edges.size],
    ]);
  }

  private nothing(): Node[] {
    const { editor } = this;
    const parts: Node[] = [title("Map", editor.graph.name)];
    if (editor.tool === "node" || editor.tool === "corridor") parts.push(this.kindField(editor.kind));
    else if (editor.tool === "edge") parts.push(this.behaviorField(editor.behavior));
    else {
      const count = (kind: string): number =>
        [...editor.graph.nodes.values()].filter((node) => node.kind === kind).length;
      const edges = (behavior: string): number =>
        [...editor.graph.edges.values()].filter((edge) => edge.behavior === behavior).length;
      parts.push(
        legend("Nodes", KINDS.map(({ value, label }) => [value, label, count(value)])),
        legend("Edges", BEHAVIORS.map(({ value, label }) => [value, label, edges(value)])),
      );
    }
    return parts;
  }

  private nodeFields(node: MapNode): Node[] {
    const { editor } = this;
    const set = (label: string, change: Partial<MapNode>): void => {
      const now = editor.graph.nodes.get(node.id);
      if (now) editor.do(replaceNodes(editor.graph, label, [{ ...now, ...change }]));
    };
    return [
      title("Node", node.id),
      field("Name", "node-name", textInput("node-name", node.id, (value, input) => {
        if (value === node.id) return;
        if (!value || editor.graph.nodes.has(value)) {
          fail(input, value ? `there is a node ${value} already` : "a node needs a name");
          return;
        }
        editor.do(rename(editor.graph, node.id, value));
        editor.select([value]);
      })),
      this.kindField(node.kind),
      field("Room", "node-room", textInput("node-room", node.room ?? "", (value) => {
        set("set room", { room: value || null });
      }, { list: "room-names", placeholder: "none" })),
      h(
        "div",
        { class: "row" },
        field("x [m]", "node-x", numberInput("node-x", node.x, (x) => set("move node", { x: tidy(x) }))),
        field("y [m]", "node-y", numberInput("node-y", node.y, (y) => set("move node", { y: tidy(y) }))),
        field("Size", "node-size", numberInput("node-size", node.size, (size) => set("set size", { size }), 0.001, 1000)),
      ),
      this.edgeList("Leads to", editor.graph.outEdges(node.id), (edge) => edge.target),
      this.edgeList("Reached from", editor.graph.inEdges(node.id), (edge) => edge.source),
      this.buttons(),
    ];
  }

  private edgeFields(edge: MapEdge): Node[] {
    const { editor } = this;
    const [source, target] = [editor.graph.nodes.get(edge.source), editor.graph.nodes.get(edge.target)];
    const straight = source && target ? distance(source, target) : 0;
    const end = (label: string, id: string): HTMLElement =>
      h("button", { type: "button", class: "link", click: () => editor.goTo([id], []) }, `${label} `, h("b", {}, id));
    return [
      title("Edge", edge.id),
      h("div", { class: "ends" }, end("from", edge.source), end("to", edge.target)),
      this.behaviorField(edge.behavior),
      h(
        "div",
        { class: "row" },
        field("Length [m]", "edge-length", numberInput("edge-length", edge.length, (length) => {
          editor.do(editor.graph.patch("set length", [], [[edge.id, { ...edge, length }]]));
        }, 0)),
        field("Yaw [°]", "edge-yaw", numberInput("edge-yaw", degrees(edge.yaw), (value) => {
          const yaw = Math.atan2(Math.sin((value * Math.PI) / 180), Math.cos((value * Math.PI) / 180));
          editor.do(editor.graph.patch("set yaw", [], [[edge.id, { ...edge, yaw }]]));
        }, -360, 360)),
      ),
      h("p", { class: "note" }, `Its nodes are ${straight.toFixed(2)} m apart.`),
      this.buttons(),
    ];
  }

  private manyFields(): Node[] {
    const { editor } = this;
    const counts = [
      editor.nodes.size ? `${editor.nodes.size} node${editor.nodes.size > 1 ? "s" : ""}` : "",
      editor.edges.size ? `${editor.edges.size} edge${editor.edges.size > 1 ? "s" : ""}` : "",
    ].filter(Boolean);
    const align = (axis: "x" | "y") => (): void => {
      const nodes = [...editor.nodes].flatMap((id) => editor.graph.nodes.get(id) ?? []);
      const middle = tidy(nodes.reduce((sum, node) => sum + node[axis], 0) / nodes.length);
      editor.do(replaceNodes(editor.graph, "align", nodes.map((node) => ({ ...node, [axis]: middle }))));
    };
    return [
      title("Selected", counts.join(", ")),
      ...(editor.nodes.size ? [this.kindField(this.commonKind())] : []),
      ...(editor.edges.size ? [this.behaviorField(this.commonBehavior())] : []),
      ...(editor.nodes.size > 1
        ? [h("div", { class: "row" },
            h("button", { type: "button", click: align("x") }, "Align x"),
            h("button", { type: "button", click: align("y") }, "Align y"))]
        : []),
      this.buttons(),
    ];
  }

  private commonKind(): string {
    const kinds = new Set([...this.editor.nodes].map((id) => this.editor.graph.nodes.get(id)?.kind));
    return kinds.size === 1 ? ([...kinds][0] ?? "") : "";
  }

  private commonBehavior(): string {
    const { graph, edges } = this.editor;
    const behaviors = new Set([...edges].map((id) => graph.edges.get(id)?.behavior));
    return behaviors.size === 1 ? ([...behaviors][0] ?? "") : "";
  }

  private kindField(kind: string): HTMLElement {
    return choices("Kind", "kind", KINDS, kind, (value) => this.actions.setKind(value));
  }

  private behaviorField(behavior: string): HTMLElement {
    const auto = { value: "auto" as const, label: "From geometry", key: "0" };
    const all: readonly { value: Behavior | "auto"; label: string; key: string }[] =
      this.editor.edges.size ? BEHAVIORS : [auto, ...BEHAVIORS];
    return choices("Behaviour", "behavior", all, behavior, (value) => this.actions.setBehavior(value));
  }

  private edgeList(label: string, edges: MapEdge[], end: (edge: MapEdge) => string): HTMLElement {
    const items = edges.map((edge) =>
      h("li", {}, h(
        "button",
        { type: "button", class: `link ${edge.behavior}`, click: () => this.editor.goTo([], [edge.id]) },
        h("span", { class: "swatch", "aria-hidden": "true" }), end(edge), h("small", {}, labelOf(edge.behavior)),
      )));
    return h("section", { class: "edge-list" }, h("h3", {}, label),
      items.length ? h("ul", {}, ...items) : h("p", { class: "note" }, "nothing"));
  }

  private buttons(): HTMLElement {
    const { editor, actions } = this;
    return h(
      "div",
      { class: "row actions" },
      editor.nodes.size > 0 && h("button", { type: "button", click: () => actions.duplicate() }, "Duplicate"),
      editor.edges.size > 0 && h("button", { type: "button", click: () => actions.reverse() }, "Turn round"),
      h("button", { type: "button", class: "danger", click: () => editor.deleteSelection() }, "Delete"),
    );
  }
}

function only<Element>(
  ids: ReadonlySet<string>,
  others: ReadonlySet<string>,
  all: ReadonlyMap<string, Element>,
): Element | undefined {
  const [first] = ids;
  return ids.size === 1 && others.size === 0 && first !== undefined ? all.get(first) : undefined;
}

/** Puts the focus, and what is marked, where it was before the fields were built anew. */
function focusAgain(before: Element): void {
  const now = document.getElementById(before.id);
  now?.focus();
  if (!(now instanceof HTMLInputElement) || !(before instanceof HTMLInputElement)) return;
  if (now.type === "number") now.select(); // browsers do not tell what is marked in it
  else if (now.type === "text") now.setSelectionRange(before.selectionStart, before.selectionEnd);
}

const title = (what: string, name: string): HTMLElement =>
  h("header", { class: "what" }, h("span", {}, what), h("strong", { title: name }, name));

const field = (label: string, id: string, input: HTMLElement): HTMLElement =>
  h("div", { class: "field" }, h("label", { for: id }, label), input);

const fail = (input: HTMLInputElement, reason: string): void => {
  input.setCustomValidity(reason);
  input.reportValidity();
};

function textInput(
  id: string,
  value: string,
  set: (value: string, input: HTMLInputElement) => void,
  more: Record<string, string> = {},
): HTMLInputElement {
  const input = h("input", { id, value, maxlength: 200, autocomplete: "off", spellcheck: "false", ...more });
  input.addEventListener("input", () => input.setCustomValidity(""));
  input.addEventListener("change", () => set(input.value.trim(), input));
  return input;
}

function numberInput(
  id: string,
  value: number,
  set: (value: number) => void,
  least = -1e6,
  most = 1e6,
): HTMLInputElement {
  const input = h("input", { id, type: "number", step: "any", min: least, max: most, value: String(Number(value.toFixed(3))) });
  input.addEventListener("change", () => {
    if (input.value !== "" && input.checkValidity()) set(input.valueAsNumber);
    else input.reportValidity();
  });
  return input;
}

/** One of several values as buttons with their keys; a radio group for whoever cannot see. */
function choices<Value extends string>(
  label: string,
  name: string,
  all: readonly { value: Value; label: string; key: string }[],
  chosen: string,
  set: (value: Value) => void,
): HTMLElement {
  const options = all.map(({ value, label: text, key }) => {
    const id = `${name}-${value}`;
    const input = h("input", { type: "radio", name, id, value, change: () => set(value) });
    input.checked = value === chosen;
    return h("label", { class: `choice ${value}`, for: id }, input,
      h("span", { class: "swatch", "aria-hidden": "true" }), h("span", {}, text), h("kbd", { "aria-hidden": "true" }, key.toUpperCase()));
  });
  return h("fieldset", { class: "choices" }, h("legend", {}, label), ...options);
}

const legend = (label: string, rows: [string, string, number][]): HTMLElement =>
  h("section", { class: "legend" }, h("h3", {}, label),
    h("ul", {}, ...rows.map(([value, text, count]) =>
      h("li", { class: value }, h("span", { class: "swatch", "aria-hidden": "true" }), text, h("b", {}, String(count))))));
