// Runs bindings/conformance.txt on an OspIndex and on an OspScene.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using OspCulling;

sealed class Cases : IDisposable
{
    const float SceneReach = 1e15f;

    OspIndex index;
    OspScene scene;
    readonly Dictionary<uint, uint> inIndex = new Dictionary<uint, uint>();
    readonly Dictionary<uint, uint> inScene = new Dictionary<uint, uint>();
    uint[] ids;
    uint[] answer = new uint[0];
    uint hitId;
    float hitT;

    /// <summary>How many answers were compared; throws at the first that is wrong, with its line.</summary>
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
        if (index != null)
        {
            index.Dispose();
            scene.Dispose();
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
                index = new OspIndex();
                scene = new OspScene(new OspSceneConfig {
                    Index = new OspIndexConfig { RootSize = 16, Capacity = 64 }, Occlusion = OspOcclusion.None, DrawNs = 10 });
                inIndex.Clear();
                inScene.Clear();
                return 0;
            case "box":
                Put(uint.Parse(words[1]), BoxOf(Floats(words, 2, 6)));
                return 0;
            case "remove":
                uint id = uint.Parse(words[1]);
                index.Remove(inIndex[id]);
                scene.Remove(inScene[id]);
                inIndex.Remove(id);
                inScene.Remove(id);
                return 0;
            case "view":
                View(Floats(words, 1, 16));
                return 0;
            case "boxquery":
                Commit();
                OspBox box = BoxOf(Floats(words, 1, 6));
                int count = Grown((Span<uint> room, out int found) => index.BoxQuery(box, room, out found));
                answer = Names(count, inIndex);
                count = Grown((Span<uint> room, out int found) => scene.BoxQuery(box, room, out found));
                CompareScene(count);
                return 0;
            case "sphere":
                Commit();
                float[] s = Floats(words, 1, 4);
                count = Grown((Span<uint> room, out int found) => index.SphereQuery(s[0], s[1], s[2], s[3], room, out found));
                answer = Names(count, inIndex);
                return 0;
            case "ray":
                Ray(Floats(words, 1, 7));
                return 0;
            case "visible":
            case "found":
                Test.Expect(answer.SequenceEqual(words.Skip(1).Select(uint.Parse)), text);
                return 1;
            case "hit":
                if (words[1] == "none")
                {
                    Test.Expect(hitId == Osp.NoId, text);
                    return 1;
                }
                float t = Float(words[2]);
                Test.Expect(hitId == uint.Parse(words[1]) && Math.Abs(hitT - t) <= 1e-4f * t, text);
                return 1;
            default:
                throw new Exception("no step begins with " + words[0]);
        }
    }

    delegate bool Query(Span<uint> room, out int found);

    /// <summary>Asks first with no room, then with exactly as much as was said.</summary>
    int Grown(Query query)
    {
        int count, again;
        ids = new uint[0];
        if (!query(ids, out count))
        {
            Test.Expect(count > 0, "a count");
            ids = new uint[count];
            Test.Expect(query(ids, out again) && again == count, "room for all");
        }
        return count;
    }

    void Put(uint id, OspBox box)
    {
        bool forScene = Math.Abs(box.MaxX) <= SceneReach;
        uint own;
        if (inIndex.TryGetValue(id, out own))
        {
            index.Update(own, box);
            scene.UpdateBox(inScene[id], box);
            return;
        }
        own = index.Insert(box);
        inIndex[id] = own;
        Test.Expect(index.Box(own).Equals(box), "the box that was put");
        if (forScene)
        {
            inScene[id] = scene.InsertBox(box);
        }
        else
        {
            Test.Refused(OspStatus.InvalidBox, () => scene.InsertBox(box));
        }
    }

    void Commit()
    {
        index.Commit();
        scene.Commit();
    }

    void View(float[] matrix)
    {
        Commit();
        uint[] room = null;
        int count = index.Frustum(matrix, OspDepth.ZeroToOne, ref room);
        ids = room;
        answer = Names(count, inIndex);
        count = Grown((Span<uint> to, out int found) => scene.Frustum(matrix, OspDepth.ZeroToOne, to, out found));
        CompareScene(count);
        if (matrix[3] == 0 && matrix[7] == 0 && matrix[11] == 0)
        {
            Test.Refused(OspStatus.InvalidView, () => scene.Frame(matrix, OspDepth.ZeroToOne));
            return;
        }
        OspFrame frame = scene.Frame(matrix, OspDepth.ZeroToOne);
        count = scene.Visible(0, ref ids);
        Test.Expect(frame.Visible == (ulong)count && frame.Count == (ulong)scene.Count, "the books of a frame");
        CompareScene(count);
    }

    void Ray(float[] r)
    {
        Commit();
        float[] origin = { r[0], r[1], r[2] }, direction = { r[3], r[4], r[5] };
        OspHit hit = index.Ray(origin, direction, r[6], OspRayMode.Nearest);
        OspHit any = index.Ray(origin, direction, r[6], OspRayMode.Any);
        OspHit of = scene.Ray(origin, direction, r[6], OspRayMode.Nearest);
        Test.Expect(hit.IsHit == any.IsHit && hit.IsHit == of.IsHit && hit.T == of.T, "rays of all kinds");
        hitId = hit.IsHit ? inIndex.First(pair => pair.Value == hit.Id).Key : Osp.NoId;
        hitT = hit.T;
    }

    /// <summary>The first ids of the answer, as the file has them.</summary>
    uint[] Names(int count, Dictionary<uint, uint> map)
    {
        for (int i = 1; i < count; i++)
        {
            Test.Expect(ids[i - 1] < ids[i], "ascending ids");
        }
        Dictionary<uint, uint> back = map.ToDictionary(pair => pair.Value, pair => pair.Key);
        return ids.Take(count).Select(own => back[own]).OrderBy(id => id).ToArray();
    }

    void CompareScene(int count)
    {
        Test.Expect(Names(count, inScene).SequenceEqual(answer.Where(inScene.ContainsKey)), "the scene's answer is the index's");
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
