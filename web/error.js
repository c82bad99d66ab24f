/**
 * What a person is told: one sentence that names the file, the thing and the fix. Any other exception is a fault of
 * this module.
 */
export class SoupError extends Error {}
