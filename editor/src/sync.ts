// Saving as you draw, and noticing when somebody else wrote the file.

import { api, Refused } from "./api";
import { byId, h, settled } from "./dom";
import type { Editor } from "./editor";

const SAVE_AFTER_MS = 700;
const LOOK_EVERY_MS = 2500;

type State = "saved" | "unsaved" | "saving" | "failed" | "changed";

export class Sync {
  private state: State = "saved";
  private dirty = false;
  private saving: Promise<void> | null = null;
  private writes = 0;
  private readonly saveSoon = settled(() => void this.save(), SAVE_AFTER_MS);

  constructor(
    private readonly editor: Editor,
    private base: string,
  ) {
    editor.on(["graph"], () => this.edited());
    window.setInterval(() => void this.look(), LOOK_EVERY_MS);
    document.addEventListener("visibilitychange", () => {
      if (document.hidden && this.dirty) void this.save();
      else void this.look();
    });
    window.addEventListener("beforeunload", (event) => {
      if (this.dirty) event.preventDefault();
    });
    this.show(base ? "saved" : "unsaved", base ? "Saved" : "New file");
  }

  /** Tells that an edit is under way: nothing is saved until it ends. */
  hold = false;

  async save(): Promise<void> {
    if (this.saving) await this.saving;
    if (this.state === "changed" || this.hold) return;
    this.saving = this.write(false);
    await this.saving;
    this.saving = null;
  }

  private edited(): void {
    if (this.ignoreNext) return;
    this.dirty = true;
    if (this.state !== "changed") {
      if (this.state !== "failed") this.show("unsaved", "Not saved yet");
      this.saveSoon.later();
    }
  }
  private ignoreNext = false;

  private async write(overwrite: boolean): Promise<void> {
    const map = this.editor.graph.toDocument();
    this.dirty = false;
    this.writes += 1;
    this.show("saving", "Saving…");
    try {
      const version = await api.save(map, this.base, overwrite);
      if (version === null) {
        this.dirty = true;
        this.changedOnDisk();
        return;
      }
      this.base = version;
      const time = new Date().toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
      if (this.dirty) this.show("unsaved", "Not saved yet");
      else this.show("saved", `Saved ${time}`);
    } catch (error) {
      this.dirty = true;
      const { message, remedy } = error as Refused;
      this.show("failed", "Not saved");
      this.notice("failed", `Not saved. ${message}.${remedy ? ` Remedy: ${remedy}.` : ""}`, [
        ["Try again", () => void this.save()],
      ]);
      return;
    }
    this.closeNotice("failed");
  }

  private async look(): Promise<void> {
    if (this.saving || this.state === "changed" || document.hidden) return;
    const writes = this.writes;
    try {
      const version = await api.version();
      if (writes === this.writes && !this.saving && version !== this.base) this.changedOnDisk();
      else if (this.state === "failed" && !this.saving) void this.save();
    } catch (error) {
      if (this.state !== "failed") {
        this.show("failed", "No server");
        this.notice(
          "failed",
          `${(error as Refused).message}. What you drew is kept in this page; ` +
            "copy it (Ctrl+A, Ctrl+C) before you close it.",
          [["Try again", () => void this.save()]],
        );
      }
    }
  }

  private changedOnDisk(): void {
    this.show("changed", "Changed on disk");
    const lost = this.dirty ? " Your last edits are not saved." : "";
    this.notice("changed", `Another program changed ${this.editor.file}.${lost}`, [
      ["Reload it", () => void this.reload()],
      ["Overwrite it", () => void this.overwrite()],
      ["Save mine as a copy", () => void this.copy()],
    ]);
  }

  private async reload(): Promise<void> {
    try {
      const opened = await api.open();
      this.base = opened.version;
      this.ignoreNext = true;
      this.editor.replaceMap(opened.map);
      this.ignoreNext = false;
      this.dirty = false;
      this.closeNotice("changed");
      this.show("saved", "Reloaded");
      this.editor.say("Reloaded the map from disk");
    } catch (error) {
      this.changedOnDisk();
      const { message } = error as Refused;
      byId("notice-text").append(` It cannot be reloaded: ${message}.`);
    }
  }

  private async overwrite(): Promise<void> {
    this.closeNotice("changed");
    await this.write(true);
    this.editor.say("Overwritten; what was on disk is kept beside it");
  }

  private async copy(): Promise<void> {
    try {
      const file = await api.saveCopy(this.editor.graph.toDocument());
      await this.reload();
      this.show("saved", `Yours is in ${file}`);
      this.editor.say(`Saved your map as ${file} and reloaded the other`);
    } catch (error) {
      byId("notice-text").append(` ${(error as Refused).message}.`);
    }
  }

  private show(state: State, text: string): void {
    const status = byId("file-status");
    if (this.state === state && status.textContent === text) return;
    this.state = state;
    status.dataset["state"] = state;
    status.textContent = text;
  }

  private notice(kind: string, text: string, choices: [string, () => void][]): void {
    const bar = byId("notice");
    bar.dataset["kind"] = kind;
    bar.hidden = false;
    bar.replaceChildren(
      h("span", { id: "notice-text" }, text),
      ...choices.map(([label, act]) => h("button", { type: "button", click: act }, label)),
    );
  }

  private closeNotice(kind: string): void {
    const bar = byId("notice");
    if (bar.dataset["kind"] === kind) bar.hidden = true;
  }
}
