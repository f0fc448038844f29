import { useEffect, useRef, useState } from 'preact/hooks';
import * as format from '../format';
import { useStore } from '../hooks';
import type { Upload } from '../store';
import { addUploads, cancelUpload, dismissUpload, homeAndHeatFirst } from '../uploads';
import { Icon } from './Icon';
import { Name } from './Name';

/**
 * A file may be dropped anywhere: otherwise the browser would replace the page by the dropped file.
 */
function usePageDrop(send: (files: File[]) => void): boolean {
  const [over, setOver] = useState(false);
  const latest = useRef(send);
  latest.current = send;
  useEffect(() => {
    const hasFiles = (event: DragEvent) => Array.from(event.dataTransfer?.types ?? []).includes('Files');
    const enter = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setOver(true);
    };
    const leave = (event: DragEvent) => event.relatedTarget === null && setOver(false);
    const drop = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setOver(false);
      latest.current(Array.from(event.dataTransfer?.files ?? []));
    };
    const listeners = { dragover: enter, dragleave: leave, drop } as const;
    for (const [name, listener] of Object.entries(listeners)) addEventListener(name, listener as EventListener);
    return () => {
      for (const [name, listener] of Object.entries(listeners)) removeEventListener(name, listener as EventListener);
    };
  }, []);
  return over;
}

const ROWS_SHOWN = 6;

/** The progress: bytes sent, speed, time left; or what it waits for. */
function words(one: Upload, ahead: number): string {
  switch (one.phase) {
    case 'waiting': return ahead > 0 ? `Waits behind ${ahead}` : 'Waits';
    case 'checking': return 'Sent. Each line is checked now …';
    case 'queued': return 'Queued';
    case 'cancelled': return 'Cancelled: nothing was queued';
    default: {
      const sent = `${format.bytes(one.sent)} of ${format.bytes(one.size)}`;
      if (one.rate === null) return sent;
      return one.rate < 1 ? `${sent} · no progress` : `${sent} · ${format.bytes(Math.round(one.rate))}/s · ${format.duration((one.size - one.sent) / one.rate)} left`;
    }
  }
}

function UploadRow({ one, ahead }: { one: Upload; ahead: number }) {
  if (one.phase === 'refused') {
    return (
      <li class="failed" data-testid="upload">
        <div class="row">
          <span class="name"><Name>{one.name}</Name></span>
          <button class="quiet" aria-label={`Dismiss ${format.visible(one.name)}`} onClick={() => dismissUpload(one.key)}><Icon name="cross" /></button>
        </div>
        <p class="error" role="alert"><strong>Not queued.</strong> <Name>{one.error ?? ''}</Name></p>
        {one.offer && <button data-testid="home-and-heat" onClick={() => homeAndHeatFirst(one.key)}>Home and heat first</button>}
      </li>
    );
  }
  const onItsWay = one.phase === 'waiting' || one.phase === 'sending';
  return (
    <li data-testid="upload" data-phase={one.phase}>
      <div class="row">
        <span class="name"><Name>{one.name}</Name></span>
        {onItsWay && <button class="quiet" aria-label={`Cancel the upload of ${format.visible(one.name)}`} onClick={() => cancelUpload(one.key)}>Cancel</button>}
      </div>
      {one.phase === 'sending' && <progress max={one.size || 1} value={one.sent} aria-label={`Upload of ${format.visible(one.name)}`} />}
      {one.phase === 'checking' && <progress aria-label={`Check of ${format.visible(one.name)}`} />}
      <p class="muted sent">{words(one, ahead)}</p>
    </li>
  );
}

function Uploads() {
  const uploads = useStore((s) => s.uploads);
  if (uploads.length === 0) return null;
  const waiting = uploads.filter((one) => one.phase === 'waiting');
  const busy = uploads.some((one) => one.phase === 'sending' || one.phase === 'checking') ? 1 : 0;
  const hidden = waiting.slice(ROWS_SHOWN);
  const rows = uploads.filter((one) => !hidden.includes(one));
  return (
    <>
      <ul class="uploads">{rows.map((one) => <UploadRow key={one.key} one={one} ahead={waiting.indexOf(one) + busy} />)}</ul>
      {hidden.length > 0 && (
        <div class="row more-uploads">
          <span class="muted">and {format.count(hidden.length)} more files wait</span>
          <button class="quiet" onClick={() => waiting.forEach((one) => cancelUpload(one.key))}>Cancel all that wait</button>
        </div>
      )}
    </>
  );
}

export function DropZone() {
  const [print, setPrint] = useState(true);
  const input = useRef<HTMLInputElement>(null);
  const over = usePageDrop((files) => addUploads(files, print));
  return (
    <div class="card upload-card">
      <h2 class="unseen">Upload</h2>
      <div class={`drop ${over ? 'over' : ''}`} data-testid="drop">
        <Icon name="upload" size={32} />
        <p>{over ? 'Let go to upload' : 'Drop G-code here'}</p>
        <button class="primary" onClick={() => input.current?.click()}>Choose files</button>
        <input ref={input} type="file" accept=".gcode,.gco,.g" multiple hidden data-testid="file" aria-label="G-code files"
          onChange={(event) => {
            addUploads(Array.from(event.currentTarget.files ?? []), print);
            event.currentTarget.value = '';
          }} />
        <label class="check">
          <input type="checkbox" checked={print} onChange={(event) => setPrint(event.currentTarget.checked)} />
          Print when it is its turn
        </label>
      </div>
      <Uploads />
    </div>
  );
}
