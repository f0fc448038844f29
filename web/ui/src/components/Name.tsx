import * as format from '../format';

/**
 * A name, or a sentence with one in it, that somebody else has given. It keeps its direction to
 * itself, and what would turn or hide letters in it is seen.
 */
export const Name = ({ children }: { children: string }) => <bdi>{format.visible(children)}</bdi>;
