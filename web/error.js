/** An error to show to the user: one line with the file, the problem and the fix. Other exceptions are bugs. */
export class SoupError extends Error {}
