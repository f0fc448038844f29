import { useStore } from '../hooks';
import { asOf, clockOf, isOld } from '../silence';
import { Icon } from './Icon';

/** In the header: that nothing is heard, and since when. */
export function SilenceChip() {
  const silent_s = useStore((s) => s.silent_s);
  return silent_s === null ? null : <span class="chip silent" data-testid="silent">No news for {silent_s} s</span>;
}

/** Beside values: the time that they are of, while that is not now. */
export function AsOf() {
  const text = useStore(asOf);
  return text === null ? null : <span class="as-of" data-testid="as-of">{text}</span>;
}

/** Why nothing can be pressed. A service that is not reached at all is Banner's. */
export function SilenceNotice() {
  const since = useStore((s) => (s.online && isOld(s) && s.newsAt_ms !== null ? clockOf(s.newsAt_ms) : null));
  if (since === null) return null;
  return (
    <section class="banners" aria-label="Silence">
      <div class="banner warning" data-testid="silence">
        <Icon name="warning" size={22} />
        <span role="alert">
          <strong>The print service is silent since {since}.</strong> What is shown is of then, and a print that runs goes on. The emergency
          stop is tried all the same; this page goes on by itself when the service speaks again.
        </span>
      </div>
    </section>
  );
}
