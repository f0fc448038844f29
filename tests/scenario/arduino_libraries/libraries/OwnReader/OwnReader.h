#pragma once
int readTable(int index);
