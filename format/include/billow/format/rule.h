// The rules of a pack by number, for whoever reports that one is broken.
#ifndef BILLOW_FORMAT_RULE_H
#define BILLOW_FORMAT_RULE_H

#include <cstdint>
#include <string>

#include "billow/format/issue.h"

namespace billow::format {

// The ids of the catalogue (issue.cpp). Never renumber: retire an id and leave its line as a comment.
enum class Rule : std::uint16_t {
  cannotOpen = 1,
  cannotRead = 2,
  tooManyBricks = 3,
  tableLimit = 4,
  frameLimit = 5,
  memory = 6,

  tooShort = 101,
  magic = 102,
  headerChecksum = 103,
  majorVersion = 104,
  minorVersion = 105,
  fileSize = 106,
  headerReserved = 107,
  contentsRange = 108,
  contentsChecksum = 109,
  sectionFlags = 110,
  sectionAlignment = 111,
  sectionOrder = 112,
  sectionRange = 113,
  sectionDuplicate = 114,
  sectionMissing = 115,
  sectionUnknown = 116,
  padding = 117,
  paddingLength = 118,
  fileEnd = 119,
  sectionChecksum = 120,

  tableSize = 201,
  stringsUtf8 = 202,
  stringRange = 203,
  nameEmpty = 204,
  nameDuplicate = 205,
  volumeRanges = 206,
  frameRate = 207,
  look = 208,
  gridVolume = 209,
  gridRole = 210,
  gridType = 211,
  frameNumber = 212,
  frameTime = 213,
  frameFlags = 214,
  tableReserved = 215,
  gridFrameFlags = 216,
  transform = 217,
  gridFrameValues = 218,
  gridFrameBox = 219,
  gridFrameOrigin = 220,
  gridFrameEmpty = 221,
  pageListRange = 222,
  pageListOrder = 223,
  pageListPage = 224,
  gridFrameNode5 = 225,
  frameBlank = 226,
  infoUtf8 = 227,
  pageCodec = 230,
  pageSize = 231,
  pageStreams = 232,
  pageOffset = 233,
  streamLength = 234,
  levelVolumes = 240,
  levelContents = 241,
  levelPlace = 242,
  levelErrors = 243,

  pageChecksum = 301,
  pageDecompress = 302,
  pageMissing = 304,
  pageSuperfluous = 305,
  pageUnused = 306,
  itemUnused = 307,

  nodeChildren = 401,
  nodeFlags = 402,
  nodeFinite = 403,
  nodeRange = 404,
  childIndex = 405,
  nodeConservative = 406,
  nodeTileActive = 407,
  nodeTile = 408,

  brickEncoding = 501,
  brickUnits = 502,
  brickMask = 503,
  brickFinite = 504,
  brickScale = 505,
  brickMean = 506,
  brickOverlap = 507,

  counts = 601,
  activeVoxels = 602,
  activeBox = 603,
  activeBoxLoose = 604,
  valueRange = 605,

  effectRanges = 701,
  effectValues = 702,
  effectAlive = 703,
  emitterValues = 704,
  emitterSpans = 705,
  effectReference = 706,
  materialProfile = 707,
  materialValues = 708,
  effectTable = 709,
  trackRanges = 710,
  trackData = 711,
  givenRanges = 712,
  givenValues = 713,
  emitterSurface = 714,
};

// The catalogue's entry; the id must be in it.
const IssueKind& kindOf(Rule rule);
Issue makeIssue(Rule rule, const Place& place, std::string detail);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_RULE_H
