// Finds nodes, edges and rooms by name.

import { byId, h } from "./dom";
import type { Editor } from "./editor";

const MOST_SHOWN = 40;

interface Found {
  what: string;
  name: string;
  open: () => void;
}

export class Search {
  private readonly input = byId<HTMLInputElement>("search");
  private readonly list = byId("search-results");
  private found: Found[] = [];
  private at = 0;

  constructor(
    private readonly editor: Editor,
    private readonly stage: HTMLElement,
  ) {
    this.input.addEventListener("input", () => this.look());
    this.input.addEventListener("focus", () => this.look());
    this.input.addEventListener("blur", () => window.setTimeout(() => this.close(), 120));
    this.input.addEventListener("keydown", (event) => this.key(event));
  }

  focus(): void {
    this.input.focus();
    this.input.select();
  }

  private look(): void {
    const { graph, rooms } = this.editor;
    const words = this.input.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const matches = (name: string): boolean => words.every((word) => name.toLowerCase().includes(word));
    const nodes = [...graph.nodes.values()].filter((node) => matches(node.id)).map((node) => ({
      what: node.kind.replace("_", " "), name: node.id, open: () => this.editor.goTo([node.id], []),
    }));
    const edges = [...graph.edges.values()].filter((edge) => matches(edge.id)).map((edge) => ({
      what: "edge", name: edge.id, open: () => this.editor.goTo([], [edge.id]),
    }));
    const drawn = new Set([...graph.nodes.values()].map((node) => node.room));
    const others = rooms.all.filter((room) => !drawn.has(room.name) && room.at && matches(room.name)).map((room) => ({
      what: "room without nodes", name: room.name,
      open: () => this.editor.goTo([], [], { x: room.at![0], y: room.at![1] }),
    }));
    this.found = words.length ? [...nodes, ...others, ...edges].slice(0, MOST_SHOWN) : [];
    this.at = 0;
    this.show();
  }

  private show(): void {
    this.list.replaceChildren(...this.found.map((one, number) =>
      h("li", {
        role: "option",
        id: `found-${number}`,
        "aria-selected": number === this.at ? "true" : "false",
        pointerdown: (event: Event) => {
          event.preventDefault();
          this.open(one);
        },
      }, h("span", {}, one.name), h("small", {}, one.what))));
    const isOpen = this.found.length > 0;
    this.list.hidden = !isOpen;
    this.input.setAttribute("aria-expanded", String(isOpen));
    if (isOpen) this.input.setAttribute("aria-activedescendant", `found-${this.at}`);
    else this.input.removeAttribute("aria-activedescendant");
    document.getElementById(`found-${this.at}`)?.scrollIntoView({ block: "nearest" });
    if (this.input.value.trim()) this.editor.say(`${this.found.length} found`);
  }

  private key(event: KeyboardEvent): void {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step && this.found.length) {
      this.at = (this.at + step + this.found.length) % this.found.length;
      this.show();
      event.preventDefault();
    } else if (event.key === "Enter") {
      const one = this.found[this.at];
      if (one) this.open(one);
    } else if (event.key === "Escape") {
      this.close();
      this.stage.focus();
    }
  }

  private open(one: Found): void {
    this.input.value = "";
    this.close();
    this.stage.focus();
    one.open();
    this.editor.say(`${one.name}, ${one.what}`);
  }

  private close(): void {
    this.found = [];
    this.list.hidden = true;
    this.input.setAttribute("aria-expanded", "false");
    this.input.removeAttribute("aria-activedescendant");
  }
}
