// The sketch as a program of this computer.
#include "Arduino.h"
#include "sketch.h"

int main() {
  setup();
  for (;;) { loop(); if (!armed) usleep(100); }
}
