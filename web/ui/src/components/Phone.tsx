import { useRef, useState } from 'preact/hooks';
import { request } from '../api';
import { useStore } from '../hooks';
import { lacks } from '../store';

interface Invitation {
  url: string;
  valid_s: number;
  qr: string[];
}

const BORDER = 4; // modules: a camera needs them

/** The code as one path: a square for each dark module. */
function Code({ rows }: { rows: string[] }) {
  const size = rows.length + 2 * BORDER;
  const dark = rows.map((row, y) => [...row].map((module, x) => (module === '1' ? `M${x + BORDER} ${y + BORDER}h1v1h-1z` : '')).join('')).join('');
  return (
    <svg class="qr" viewBox={`0 0 ${size} ${size}`} shape-rendering="crispEdges" role="img" aria-label="QR code of the address below">
      <rect width={size} height={size} fill="#fff" />
      <path d={dark} fill="#000" />
    </svg>
  );
}

/**
 * Opens the page on a phone: an address that signs it in once. It stands beside the page and not in
 * front of it: the emergency stop stays within reach.
 */
export function Phone() {
  const none = useStore((s) => lacks(s, 'invitation'));
  const dialog = useRef<HTMLDialogElement>(null);
  const [invitation, setInvitation] = useState<Invitation | null>(null);
  const [problem, setProblem] = useState('');
  if (none) return null;
  const open = async () => {
    setInvitation(null);
    setProblem('');
    dialog.current?.show();
    try {
      setInvitation(await request<Invitation>('POST', 'invitation'));
    } catch (error) {
      setProblem((error as Error).message);
    }
  };
  return (
    <>
      <button class="quiet phone-button" data-testid="phone" onClick={open} title="Open this page on a phone">Phone</button>
      <dialog ref={dialog} class="phone" aria-labelledby="phone-text" data-testid="phone-dialog">
        <p id="phone-text">
          {problem || (invitation ? `Point the phone's camera at this code. It signs the phone in, once, within ${Math.round(invitation.valid_s / 60)} minutes.` : 'One moment …')}
        </p>
        {invitation && <Code rows={invitation.qr} />}
        {invitation && <p class="address" data-testid="phone-address">{invitation.url}</p>}
        <div class="actions"><button onClick={() => dialog.current?.close()}>Close</button></div>
      </dialog>
    </>
  );
}
