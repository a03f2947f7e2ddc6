// Light or dark, as the system says or as the user chose; the floor plan comes along.

import { api } from "./api";
import { byId } from "./dom";
import type { Editor } from "./editor";
import type { FloorDocument } from "./types";

const KEY = "toponav-theme";

export class Theme {
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  private readonly urls = new Map<string, Promise<string>>();

  constructor(
    private readonly editor: Editor,
    private readonly floor: FloorDocument | null,
  ) {
    byId("theme").addEventListener("click", () => this.toggle());
    this.system.addEventListener("change", () => this.show());
    this.show();
  }

  private get name(): "light" | "dark" {
    const chosen = localStorage.getItem(KEY);
    if (chosen === "light" || chosen === "dark") return chosen;
    return this.system.matches ? "dark" : "light";
  }

  private toggle(): void {
    localStorage.setItem(KEY, this.name === "dark" ? "light" : "dark");
    this.show();
    this.editor.say(`${this.name} colours`);
  }

  private show(): void {
    const { name } = this;
    document.documentElement.dataset["theme"] = name;
    byId("theme").setAttribute("aria-pressed", String(name === "dark"));
    if (this.floor) void this.showFloor(name, this.floor.extent);
  }

  private async showFloor(name: string, extent: FloorDocument["extent"]): Promise<void> {
    let url = this.urls.get(name);
    if (!url) {
      url = api.floor(name).then((image) => URL.createObjectURL(image));
      this.urls.set(name, url);
    }
    const shown = await url;
    if (name === this.name) this.editor.drawing.setFloor(extent, shown);
  }
}
