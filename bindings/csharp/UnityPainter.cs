// How a painter in Unity calls osp: each stroke is a mesh that grows while it is drawn, and the camera draws those that it may
// see. A sample to start from: it was compiled with stand-ins for Unity's names only (test/UnityNames.cs), never
// with Unity, and nothing was measured there.
//
// Put Osp.cs and this file into a folder of Assets with an assembly definition that allows unsafe code, and the library
// (osp_c.dll, libosp_c.so, libosp_c.dylib) into Assets/Plugins. Add this component to the camera.
using System;
using System.Collections.Generic;
using OspCulling;
using UnityEngine;

[RequireComponent(typeof(Camera))]
public sealed class UnityPainter : MonoBehaviour
{
    /// <summary>The room that is painted in, metres; strokes outside of it are found as well.</summary>
    public float RoomSize = 8;

    readonly Dictionary<Renderer, uint> idOf = new Dictionary<Renderer, uint>();
    readonly float[] clipFromWorld = new float[16];
    // By id; null where there is none.
    Renderer[] strokes = new Renderer[1024];
    bool[] wasDrawn = new bool[1024];
    uint[] visible = new uint[1024];
    uint[] drawn = new uint[1024];
    int drawnCount;
    OspIndex index;
    Camera eye;

    void Awake()
    {
        eye = GetComponent<Camera>();
        index = new OspIndex(new OspIndexConfig { RootY = RoomSize / 2, RootSize = RoomSize, Capacity = 1024 });
    }

    void OnDestroy()
    {
        index.Dispose();
    }

    /// <summary>A stroke begins. Its renderer has bounds from here on.</summary>
    public void Begin(Renderer stroke)
    {
        uint id = index.Insert(BoxOf(stroke.bounds));
        if (id >= strokes.Length)
        {
            int room = Math.Max(2 * strokes.Length, (int)id + 1);
            Array.Resize(ref strokes, room);
            Array.Resize(ref wasDrawn, room);
        }
        idOf.Add(stroke, id);
        strokes[id] = stroke;
        wasDrawn[id] = false;
        stroke.forceRenderingOff = true;
    }

    /// <summary>A stroke has grown or was moved: call it after the mesh has its new bounds, in the same frame.</summary>
    public void Changed(Renderer stroke)
    {
        index.Update(idOf[stroke], BoxOf(stroke.bounds));
    }

    /// <summary>A stroke was erased.</summary>
    public void Erase(Renderer stroke)
    {
        uint id = idOf[stroke];
        index.Remove(id);
        idOf.Remove(stroke);
        strokes[id] = null;
        wasDrawn[id] = false;
    }

    // After all scripts have moved things, before the camera draws.
    void OnPreCull()
    {
        index.Commit();
        // Unity's projectionMatrix has OpenGL's depth on every platform. In memory a matrix is column after column. Each eye of a
        // headset has its own: eye.GetStereoProjectionMatrix and eye.GetStereoViewMatrix; draw what either of them sees.
        Matrix4x4 matrix = eye.projectionMatrix * eye.worldToCameraMatrix;
        for (int i = 0; i < 16; i++)
        {
            clipFromWorld[i] = matrix[i];
        }
        int count = index.Frustum(clipFromWorld, OspDepth.MinusOneToOne, ref visible);
        // Both lists ascend: only what has changed is touched.
        for (int i = 0, k = 0; i < drawnCount || k < count;)
        {
            uint old = i < drawnCount ? drawn[i] : uint.MaxValue, now = k < count ? visible[k] : uint.MaxValue;
            if (old <= now)
            {
                i++;
            }
            if (now <= old)
            {
                k++;
            }
            Show(Math.Min(old, now), now <= old);
        }
        uint[] swap = drawn;
        drawn = visible;
        visible = swap;
        drawnCount = count;
    }

    void Show(uint id, bool isVisible)
    {
        if (strokes[id] != null && wasDrawn[id] != isVisible)
        {
            wasDrawn[id] = isVisible;
            strokes[id].forceRenderingOff = !isVisible;
        }
    }

    static OspBox BoxOf(Bounds bounds)
    {
        Vector3 min = bounds.min, max = bounds.max;
        return new OspBox(min.x, min.y, min.z, max.x, max.y, max.z);
    }
}
