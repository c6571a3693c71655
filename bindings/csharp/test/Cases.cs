// Runs bindings/conformance.txt on an OspCuller.
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using OspCulling;

sealed class Cases : IDisposable
{
    OspCuller culler;
    float[] matrix;
    ulong[] keys;
    uint[] answer = new uint[0];
    readonly OspHit[] hit = new OspHit[1];
    int hits;

    /// <summary>Returns the number of compared results. Throws at the first wrong result, with its line.</summary>
    public static int Run(string path)
    {
        int answers = 0, line = 0;
        using (var cases = new Cases())
        {
            foreach (string text in File.ReadLines(path))
            {
                line++;
                try
                {
                    answers += cases.Step(text);
                }
                catch (Exception e)
                {
                    throw new Exception("line " + line + " of the cases: " + e.Message, e);
                }
            }
        }
        return answers;
    }

    public void Dispose()
    {
        if (culler != null)
        {
            culler.Dispose();
        }
    }

    int Step(string text)
    {
        string[] words = text.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries);
        if (words.Length == 0 || words[0] == "#")
        {
            return 0;
        }
        switch (words[0])
        {
            case "case":
                Dispose();
                culler = new OspCuller();
                return 0;
            case "box":
                OspBox put = BoxOf(Floats(words, 2, 6));
                culler.Set(KeyOf(words[1]), put);
                Test.Expect(culler.Box(KeyOf(words[1])).Equals(put), "the box that was put");
                return 0;
            case "remove":
                culler.Remove(KeyOf(words[1]));
                return 0;
            case "quad":
                culler.SetOccluderQuad(KeyOf(words[1]), Floats(words, 2, 12));
                return 0;
            case "view":
                matrix = Floats(words, 1, 16);
                return 0;
            case "boxquery":
                culler.Commit();
                OspBox box = BoxOf(Floats(words, 1, 6));
                answer = Names(Grown((Span<ulong> room, out int found) => culler.InBox(box, room, out found)));
                return 0;
            case "sphere":
                culler.Commit();
                float[] s = Floats(words, 1, 4);
                answer = Names(Grown((Span<ulong> room, out int found) => culler.InSphere(s[0], s[1], s[2], s[3], room, out found)));
                return 0;
            case "ray":
                culler.Commit();
                float[] r = Floats(words, 1, 7);
                hits = culler.OnRay(r.AsSpan(0, 3), r.AsSpan(3, 3), r[6], hit);
                return 0;
            case "visible":
            case "unhidden":
                View(words[0] == "unhidden");
                goto case "found";
            case "found":
                Test.Expect(answer.SequenceEqual(words.Skip(1).Select(uint.Parse)), text);
                return 1;
            case "hit":
                if (words[1] == "none")
                {
                    Test.Expect(hits == 0, text);
                    return 1;
                }
                float t = Float(words[2]);
                Test.Expect(hits > 0 && hit[0].Key == KeyOf(words[1]) && Math.Abs(hit[0].T - t) <= 1e-4f * t, text);
                return 1;
            default:
                throw new Exception("no step begins with " + words[0]);
        }
    }

    delegate bool Query(Span<ulong> room, out int found);

    /// <summary>Calls first with no room, then with exactly the room that the first call reported.</summary>
    int Grown(Query query)
    {
        int count, again;
        keys = new ulong[0];
        if (!query(keys, out count))
        {
            Test.Expect(count > 0, "a count");
            keys = new ulong[count];
            Test.Expect(query(keys, out again) && again == count, "room for all");
        }
        return count;
    }

    void View(bool isHiding)
    {
        var cameras = new[] {
            new OspCamera(matrix, OspDepth.ZeroToOne), new OspCamera(matrix.Select(n => (double)n).ToArray(), OspDepth.OneToZero) };
        var seen = new OspSeen[2];
        cameras[0].HideByOccluders = isHiding;
        cameras[1].HideByOccluders = isHiding;
        culler.Cull(cameras, seen);
        answer = Names(culler.Visible(1, ref keys));
        Test.Expect(Names(culler.Visible(0, ref keys)).SequenceEqual(answer), "the same by both depths");
        Test.Expect(seen[0].Visible == answer.Length && (isHiding || seen[0].Hidden == 0), "the counts of a frame");
    }

    /// <summary>Returns the first keys of the result, in the form of the file.</summary>
    uint[] Names(int count)
    {
        Test.Expect(keys.Take(count).Distinct().Count() == count, "each key once");
        return keys.Take(count).Select(key => checked((uint)~key)).OrderBy(id => id).ToArray();
    }

    /// <summary>Turns an id of the file into a key that needs all 64 bits.</summary>
    static ulong KeyOf(string word)
    {
        return ~(ulong)uint.Parse(word);
    }

    static OspBox BoxOf(float[] n)
    {
        return new OspBox(n[0], n[1], n[2], n[3], n[4], n[5]);
    }

    static float[] Floats(string[] words, int from, int count)
    {
        Test.Expect(words.Length == from + count, count + " numbers");
        return words.Skip(from).Select(Float).ToArray();
    }

    static float Float(string word)
    {
        return float.Parse(word, NumberStyles.Float, CultureInfo.InvariantCulture);
    }
}
