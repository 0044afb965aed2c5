// SPDX-License-Identifier: Apache-2.0
// The macros of others that are in force when rowe's headers come: Qt's keywords, what X.h and Xlib.h define,
// and min() and max() as some platforms have them. The standard library's headers come first, for theirs is
// not to be tested.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstring>
#include <ctime>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

// Qt
#define signals public
#define slots
#define emit
#define foreach(variable, container) for (variable : container)
#define forever for (;;)

// X11
#define Above 0
#define AllocAll 1
#define AllocNone 0
#define Always 2
#define AnyButton 0L
#define AnyKey 0L
#define AsyncBoth 6
#define BadAccess 10
#define BadRequest 1
#define BadValue 2
#define Below 1
#define Bool int
#define ButtonPress 4
#define ClientMessage 33
#define Complex 0
#define Convex 2
#define ControlMask (1 << 2)
#define CurrentTime 0L
#define CursorShape 0
#define DestroyAll 0
#define DirectColor 5
#define DoBlue (1 << 2)
#define DoGreen (1 << 1)
#define DoRed (1 << 0)
#define Expose 12
#define False 0
#define FirstExtensionError 128
#define FocusIn 9
#define FocusOut 10
#define FontChange 255
#define GrabSuccess 0
#define GrayScale 1
#define InputOnly 2
#define InputOutput 1
#define KeyPress 2
#define KeyRelease 3
#define LastEvent 36
#define None 0L
#define NoEventMask 0L
#define NoSymbol 0L
#define Nonconvex 1
#define NotUseful 0
#define Opposite 4
#define ParentRelative 1L
#define PropertyNotify 28
#define PseudoColor 3
#define RaiseLowest 0
#define ReplayPointer 2
#define ResizeRedirect 25
#define RevertToNone (int)None
#define StaticColor 2
#define StaticGray 0
#define Status int
#define Success 0
#define True 1
#define TrueColor 4
#define Unsorted 0
#define WhenMapped 1
#define XYBitmap 0
#define YSorted 1
#define ZPixmap 2

// Some platforms
#define max(a, b) (((a) > (b)) ? (a) : (b))
#define min(a, b) (((a) < (b)) ? (a) : (b))
