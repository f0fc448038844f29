#include "PageDisplay.h"

// Off; clock; rows; offset; first row; charge pump; addressing; mounting; contrast …; on.
static const byte PROGMEM kBegin[] = {0xAE, 0xD5, 0x80, 0xA8, 63,   0xD3, 0,    0x40, 0x8D,
                                      0x14, 0x20, 0,    0xA1, 0xC8, 0xDA, 0x12, 0x81, 0xCF,
                                      0xD9, 0xF1, 0xDB, 0x40, 0xA4, 0xA6, 0xAF};

bool PageDisplay::begin(byte address) {
    address_ = address;
    wire_->begin();
    wire_->setClock(400000);
    wire_->beginTransmission(address_);
    if (wire_->endTransmission() != 0) return false;
    for (byte i = 0; i < sizeof kBegin; i++) command(pgm_read_byte(kBegin + i));
    return true;
}

void PageDisplay::command(byte code) { commands(&code, 1); }

void PageDisplay::commands(const byte* codes, byte count) {
    wire_->beginTransmission(address_);
    wire_->write(byte(0x00));
    wire_->write(codes, count);
    wire_->endTransmission();
}

void PageDisplay::dot(int x, int y) {
    if (x >= 0 && x < 128 && y >= 0 && y < 64) dots_[y / 8 * 128 + x] |= _BV(y % 8);
}

void PageDisplay::line(int x0, int y0, int x1, int y1) {
    const int dx = abs(x1 - x0), dy = -abs(y1 - y0), sx = x0 < x1 ? 1 : -1, sy = y0 < y1 ? 1 : -1;
    for (int error = dx + dy;;) {
        dot(x0, y0);
        if (x0 == x1 && y0 == y1) return;
        const int doubled = 2 * error;
        if (doubled >= dy) error += dy, x0 += sx;
        if (doubled <= dx) error += dx, y0 += sy;
    }
}

void PageDisplay::box(int x, int y, int width, int height) {
    line(x, y, x + width - 1, y);
    line(x, y + height - 1, x + width - 1, y + height - 1);
    line(x, y, x, y + height - 1);
    line(x + width - 1, y, x + width - 1, y + height - 1);
}

void PageDisplay::circle(int x, int y, int radius) {
    for (int dx = radius, dy = 0; dy <= dx; dy++) {
        for (const int turn : {1, -1}) {
            for (const int side : {1, -1}) {
                dot(x + turn * dx, y + side * dy);
                dot(x + turn * dy, y + side * dx);
            }
        }
        if (dx * dx + dy * dy >= radius * radius) dx--;
    }
}

void PageDisplay::display() {
    const byte whole[] = {0x21, 0, 127, 0x22, 0, 7};
    commands(whole, sizeof whole);
    for (int i = 0; i < 128 * 8;) {
        wire_->beginTransmission(address_);
        wire_->write(byte(0x40));
        for (byte n = 0; n < 31 && i < 128 * 8; n++) wire_->write(dots_[i++]);  // a buffer of 32
        wire_->endTransmission();
    }
}
