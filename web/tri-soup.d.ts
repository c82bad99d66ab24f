/** Anti-aliasing: none; four visibility samples per pixel; 2 x 2 shaded samples per pixel. */
export type AntiAliasing = "none" | "msaa" | "ssaa";

/**
 * Shows a soup in a page: `<tri-soup src="model.glb" poster="poster.png" camera="3" autorotate></tri-soup>`.
 * A block element; without a height its aspect ratio is 16:9. Mouse, touch and keys move the camera as in soup-view.
 * Shadow parts for styles: canvas, poster, progress, message.
 */
export class TriSoup extends HTMLElement {
  /** URL of a model.glb, or "#id" of an element whose text is one in base64. */
  src: string;
  /** URL of an image to show until the first frame is drawn. */
  poster: string;
  /** Number (from 0, test views first) or name of one of the model's cameras. */
  get camera(): string;
  set camera(value: string | number);
  /** Default: "msaa". */
  aa: AntiAliasing;
  /** Rotates the scene until the visitor moves it. Ignored if the visitor prefers reduced motion. */
  autorotate: boolean;
  /** Names of the model's cameras, test views first; empty until it is loaded. */
  readonly cameras: string[];
  /** True once `src` has been drawn. */
  readonly loaded: boolean;

  addEventListener<K extends keyof TriSoupEventMap>(type: K,
    listener: (this: TriSoup, event: TriSoupEventMap[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions): void;
}

export interface TriSoupEventMap extends Omit<HTMLElementEventMap, "load" | "progress" | "error"> {
  /** The first frame has been drawn. */
  load: Event;
  /** Part of the model has been downloaded. */
  progress: ProgressEvent;
  /** The model cannot be shown. The element shows `message`, which names the reason and a fix. */
  error: ErrorEvent;
  /** The graphics device was lost. The last frame stays visible, with a message. */
  contextlost: Event;
  /** The device was restored, and the scene is drawn again. */
  contextrestored: Event;
}

declare global {
  interface HTMLElementTagNameMap {
    "tri-soup": TriSoup;
  }
}
