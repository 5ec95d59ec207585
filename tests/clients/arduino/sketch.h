// The sketch with its prototypes, which the Arduino IDE writes by itself.
#pragma once
void quiet();
void disarm();
bool allowed();
bool hear();
bool understood();
void obey();
void hello(unsigned long number);
void set(unsigned long number, const char *argument);
void get(unsigned long number);
void acknowledge(unsigned long number);
void arm(unsigned long number);
void fire(unsigned long number, bool valve, bool trigger);
bool ended();
bool give(bool valve, bool trigger, unsigned int ticks, unsigned int &heardTicks);
#include "../../../clients/arduino/isi_timer/isi_timer.ino"
